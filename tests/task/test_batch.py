"""The arrays of a batch: constants go through their records unchanged, worlds are views of the arrays."""

import numpy as np
import pytest

from dirt_env.sim.jit import entry
from dirt_env.sim.params import Blade, Machine, Soil
from dirt_env.sim.state import WORK_SPACE
from dirt_env.sim.traction import Pull
from dirt_env.task.batch import (
    PULL,
    SCENE,
    Scratch,
    blade_of,
    job_of,
    machine_of,
    make_batch,
    pull_at,
    soil_of,
    view_of,
)
from dirt_env.task.job import Job
from dirt_env.task.observation import View


@entry
def constants_of(scenes):
    """What a kernel reads from a SCENE record."""
    return soil_of(scenes[0]), blade_of(scenes[0]), machine_of(scenes[0])


@entry
def pull_from(pulls):
    """What a kernel reads from a PULL record."""
    return pull_at(pulls, 1)


@entry
def numbers_of_view(batch):
    """The numbers of the view that a kernel reads from a SCENE record, and its arrays."""
    view = view_of(batch, batch.scenes[0])
    numbers = (view.resolution, view.ahead, view.limit, view.beyond, view.overview_cell, view.doubt)
    return numbers, view.channels, (view.offset, view.scale, view.low, view.high)


@entry
def mark(batch, w):
    """Write into one job through its views."""
    job = job_of(batch, w)
    job.target[0, 0] = 7.0
    job.centers[0, 1] = 8.0
    return job.centers.shape[0], job.soil


def distinct(kind):
    """A NamedTuple whose fields are all different, and other than their defaults."""
    return kind(*(field(index + 101) for index, field in enumerate(kind.__annotations__.values())))


def test_every_constant_of_a_scene_reaches_the_kernels():
    """A field that is new in Soil, Blade or Machine has to be read from its record too."""
    scenes = np.zeros(1, SCENE)
    constants = distinct(Soil), distinct(Blade), distinct(Machine)
    for name, values in zip(("soil", "blade", "machine"), constants, strict=True):
        scenes[name] = tuple(values)
    assert constants_of(scenes) == constants


def test_every_constant_of_traction_reaches_the_kernels_and_none_is_none():
    pulls, values = np.zeros(2, PULL), distinct(Pull)
    pulls[1] = tuple(values)
    assert pull_from(pulls) == values
    assert pull_from(None) is None


def test_every_constant_of_the_view_reaches_the_kernels():
    batch = make_batch(1, 5, 6, walls=True, open_border=True, channels=(2, 0))
    scenes = batch.scenes
    numbers = [name for name, kind in View.__annotations__.items() if kind is float]
    assert SCENE["eye"].names == tuple(numbers)
    scenes["eye"] = tuple(range(len(numbers)))
    scenes["columns"] = np.arange(4)[:, None]
    found, channels, columns = numbers_of_view(batch)
    assert found == tuple(range(len(numbers)))
    assert channels.tolist() == [2, 0]
    assert [column.tolist() for column in columns] == [[k] * len(column) for k, column in enumerate(columns)]


def test_a_job_is_a_view_of_the_arrays():
    batch = make_batch(3, 5, 6, walls=True, open_border=True, channels=(0, 1))
    batch.episodes["centers"] = 1
    batch.job.soil[:] = [4.0, 5.0, 6.0]
    assert mark(batch, 1) == (1, 5.0)
    marks = [batch.job.target[:, 0, 0], batch.job.centers[:, 0, 1]]
    assert [part.tolist() for part in marks] == [[0, 7, 0], [0, 8, 0]]


@pytest.mark.parametrize("has", [True, False])
def test_what_worlds_do_not_have_is_none(has):
    soils = 3 if has else 1
    batch = make_batch(2, 5, 6, walls=has, open_border=has, channels=(0, 1), traction=has, swell=has, soils=soils)
    names = ("outside", "solid", "pulls", "bank", "natural", "zone", "soils", "zone_pulls")
    assert [getattr(batch, name) is None for name in names] == [not has] * len(names)
    if has:
        assert batch.soils.shape == batch.zone_pulls.shape == (2, 3)


def test_a_batch_has_all_arrays_of_a_job_and_a_thread():
    assert Scratch._fields == WORK_SPACE
    job = make_batch(2, 5, 6, walls=True, open_border=True, channels=(0, 1)).job
    assert all(len(getattr(job, name)) == 2 for name in Job._fields)
