"""Policy files: the network in numpy against a plain sum and against torch, and files that are no good."""

import io
import json
import subprocess
import sys

import numpy as np
import pytest
from dirt_env.agents.frames import channel_places
from dirt_env.agents.network import Convolution, append_roots, load, read, root_overview, written

from dirt_env.bench.evaluate.episode import Trial, run_trial
from dirt_env.bench.evaluate.suite import Task
from dirt_env.cli import main
from dirt_env.config import load as load_scene
from dirt_env.policy import load_policy, needed, policy_file

from .conftest import METADATA, SEEN, smoke, weights


def slow_convolution(images, weight, bias, stride):
    """One number at a time."""
    count, _, rows, cols = images.shape
    filters, _, size, _ = weight.shape
    result = np.zeros((count, filters, (rows - size) // stride + 1, (cols - size) // stride + 1))
    for n, f, i, j in np.ndindex(result.shape):
        window = images[n, :, i * stride : i * stride + size, j * stride : j * stride + size]
        result[n, f, i, j] = max(0.0, float((window * weight[f]).sum() + bias[f]))
    return result


@pytest.mark.parametrize("stride", [1, 2, 3])
def test_a_convolution_is_a_sum_over_windows(stride):
    generator = np.random.default_rng(0)
    images, weight, bias = (generator.standard_normal(shape) for shape in ((2, 3, 9, 8), (4, 3, 3, 3), (4,)))
    expected = slow_convolution(images, weight, bias, stride)
    np.testing.assert_allclose(Convolution(weight, bias, stride)(images), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("frames", "normalise", "roots", "overview", "share"),
    [
        (1, True, False, False, True),
        (1, False, False, True, True),
        (3, True, False, False, True),
        (1, True, True, True, True),
        (1, True, True, True, False),
        (3, True, True, True, True),
        (2, True, True, False, True),
    ],
)
def test_numpy_and_torch_act_the_same(frames, normalise, roots, overview, share, tmp_path):
    pytest.importorskip("stable_baselines3")
    import torch
    from dirt_env.agents.export import actor_arrays, actor_metadata
    from dirt_env.agents.trainer import Trainer

    overrides = {
        "normalise": {"pose": normalise},
        "worlds": {"frames": frames, "set": {"observation": {"overview": overview}}},
        "network": {"hidden": [16, 8], "roots": roots},
        "ppo": {"share_features": share},
    }
    trainer = Trainer(smoke(**overrides), tmp_path)
    generator = np.random.default_rng(0)
    with torch.no_grad():
        for parameter in trainer.model.policy.parameters():
            parameter += 0.3 * torch.randn_like(parameter)
    if normalise:
        trainer.env.obs_rms["pose"].update(generator.standard_normal((50, 15 * frames)))
    site = generator.exponential(0.01, (64, 2, 12, 12)).astype(np.float32)
    site[:8, 0], site[8:16, 0, 3:], site[16:24, 0] = 0.0, -0.1, 1e-5 * site[16:24, 0]
    steps = [
        {
            "patch": generator.standard_normal((64, 2, 8, 8)).astype(np.float32),
            "pose": generator.uniform(-2, 2, (64, 15)).astype(np.float32),
            **({"overview": site} if overview else {}),
        }
        for _ in range(frames)
    ]
    stacked = {name: np.concatenate([seen[name] for seen in steps], axis=1) for name in ("patch", "pose")}
    stacked = {**steps[-1], **stacked}
    expected, _ = trainer.model.predict(trainer.env.normalize_obs(stacked), deterministic=True)
    config = trainer.course.native.envs[0].config
    metadata = actor_metadata(trainer.model.policy, config, trainer.settings.worlds, 10.0)
    content = written(actor_arrays(trainer.model.policy, trainer.env), metadata)
    trainer.close()
    (tmp_path / "it.npz").write_bytes(content)
    policy = load(tmp_path / "it.npz", load_scene())
    acted = [policy.act_all(seen) for seen in steps][-1]
    np.testing.assert_allclose(acted, expected, atol=1e-5)
    assert acted.std(axis=0).min() > 0.1
    policy.reset()
    one = [policy.act({name: array[3] for name, array in seen.items()}) for seen in steps][-1]
    np.testing.assert_allclose(one, expected[3], atol=1e-5)
    assert policy.observation["size"] == 8
    assert policy.network.roots == (tuple(range(1, 2 * frames, 2)) if roots else ())
    if roots and overview:  # how the soil that is left is spread counts, not how much it is
        less = {name: array[30:31].copy() for name, array in steps[-1].items()}
        more = {name: array.copy() for name, array in less.items()}
        more["overview"][0, 0] *= 2.0
        policy.reset()
        one = policy.act_all(less)
        policy.reset()
        np.testing.assert_allclose(policy.act_all(more), one, atol=1e-5)
        policy.reset()
        more["overview"][0, 0] = more["overview"][0, 0, ::-1]
        assert np.abs(policy.act_all(more) - one).max() > 1e-3


def test_roots_show_thin_remnants():
    patch = np.zeros((1, 4, 2, 2), np.float32)
    patch[0, 1, 0, 0], patch[0, 3, 1, 1] = 0.04, -0.25
    seen = append_roots(patch, channel_places("todo", ["height", "todo"], 2))
    assert seen.shape == (1, 6, 2, 2)
    np.testing.assert_array_equal(seen[:, :4], patch)
    np.testing.assert_allclose(seen[0, 4], [[0.2, 0.0], [0.0, 0.0]], rtol=1e-6)
    np.testing.assert_allclose(seen[0, 5], [[0.0, 0.0], [0.0, -0.5]], rtol=1e-6)


def test_what_is_left_shows_however_little_it_is():
    overview = np.random.default_rng(0).uniform(size=(1, 2, 12, 12)).astype(np.float32)
    overview[0, 0] = 0.0
    overview[0, 0, 3, 4], overview[0, 0, 5, 6] = 0.01, 0.03
    shown = root_overview(overview)
    assert shown[0, 0, 3, 4] == pytest.approx(0.5 * 0.25**0.5)
    assert shown[0, 0, 5, 6] == pytest.approx(0.5 * 0.75**0.5)
    assert np.count_nonzero(shown[0, 0]) == 2
    np.testing.assert_array_equal(shown[:, 1], overview[:, 1])
    np.testing.assert_allclose(root_overview(overview * np.float32([[[[0.1]], [[1.0]]]])), shown, rtol=1e-5)
    overview[0, 0] = 0.0
    assert not root_overview(overview)[0, 0].any()  # nothing is left
    overview[0, 0, 7, 7] = 1e-5  # next to nothing, and a square that lies too low
    overview[0, 0, 8, 8] = -1.0
    assert root_overview(overview)[0, 0].max() == pytest.approx(0.5 * 0.01**0.5)
    assert np.count_nonzero(root_overview(overview)[0, 0]) == 1


def test_it_runs_where_there_is_no_torch(pusher):
    code = f"""
import sys
sys.modules["torch"] = sys.modules["stable_baselines3"] = None
from dirt_env.config import load
from dirt_env.env import DirtPushEnv
from dirt_env.policy import load_policy, needed
policy = load_policy({str(pusher)!r}, load())
env = DirtPushEnv(**needed(policy))
print(policy.act(env.reset(seed=0)[0]).tolist())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout == f"{np.array([0.0, 0.25, 0.0], np.float32).tolist()}\n", done.stderr


def test_the_environment_shows_what_the_network_was_trained_with(pusher):
    policy = load_policy(str(pusher), load_scene("posts"))
    assert needed(policy) == {"observation": SEEN, "action": {"blade": "tracks"}}
    assert needed(load_policy("adaptive_push", load_scene())) == {"observation": {"map": True}}
    assert needed(load_policy("idle", load_scene())) == {}
    assert policy_file(str(pusher)) == pusher


def test_run_and_evaluate_take_a_file(pusher, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for scene in ("heap", "posts"):  # the second one with obstacles, which the network does not see
        assert main(["run", "--scene", scene, "--policy", "./pusher.npz", "--steps", "30", "--no-replay"]) == 0
    summary = json.loads((tmp_path / "runs" / "heap-pusher" / "summary.json").read_text())
    assert summary["sees"] == "patch"
    assert summary["config"]["observation"]["size"] == 8
    assert summary["mean"]["distance_m"] > 5.0
    record = run_trial(Trial(str(pusher), Task("heap", 0, "heap", {"level": 0}, steps=24), 8000))
    assert record["metrics"]["volume_distance_m4_per_min"] > 10.0


def test_the_same_weights_give_the_same_bytes():
    assert written(weights(), METADATA) == written(weights(), METADATA)


def changed(name, array=None):
    arrays = weights(np.random.default_rng(0))
    if array is None:
        del arrays[name]
    else:
        arrays[name] = array
    return arrays


@pytest.mark.parametrize(
    ("arrays", "complaint"),
    [
        (changed("action.bias"), "action.bias is missing"),
        (changed("conv0.weight", np.zeros((4, 3, 3, 3), np.float32)), r"conv0.weight is float32\[4, 3, 3, 3\]"),
        (changed("hidden0.weight", np.zeros((16, 5), np.float32)), "hidden0.weight is .*allowed: finite"),
        (changed("pose.mean", np.zeros(15)), r"pose.mean is float64\[15\]"),
        (changed("action.bias", np.array([0, np.nan, 0], np.float32)), "action.bias is .*allowed: finite"),
        (changed("action.bias", np.array([None, 1, 2])), "cannot be read as a .npz of plain arrays$"),
    ],
)
def test_what_is_no_policy_is_refused(arrays, complaint, tmp_path):
    path = tmp_path / "bad.npz"
    content = io.BytesIO()
    text = json.dumps({"format": "dirt-push policy 1", **METADATA}).encode()
    np.savez(content, metadata=np.frombuffer(text, np.uint8), **arrays)
    path.write_bytes(content.getvalue())
    with pytest.raises(ValueError, match=f"policy .*bad.npz is damaged or no policy: .*{complaint}"):
        load_policy(str(path), load_scene())


def test_a_file_that_is_none_or_cut_off(pusher, tmp_path):
    with pytest.raises(ValueError, match="is no file; allowed: a policy"):
        load_policy(str(tmp_path / "none.npz"), load_scene())
    whole = pusher.read_bytes()
    for length in range(0, len(whole), 97):
        pusher.write_bytes(whole[:length])
        with pytest.raises(ValueError, match="is damaged or no policy"):
            load_policy(str(pusher), load_scene())


@pytest.mark.parametrize(
    ("metadata", "complaint"),
    [
        ({}, "it has no metadata in JSON"),
        ({"metadata": np.frombuffer(b"{", np.uint8)}, "it has no metadata in JSON"),
        ({"metadata": np.frombuffer(b"{}", np.uint8)}, "its format is None; allowed: 'dirt-push policy 1'"),
        (
            {"metadata": np.frombuffer(b'{"format": "dirt-push policy 1", "clip": 1}', np.uint8)},
            "its metadata has no observation and no action and no strides and no hidden",
        ),
    ],
)
def test_metadata_that_is_not_there_is_named(metadata, complaint, tmp_path):
    np.savez(tmp_path / "bad.npz", **metadata, **weights())
    with pytest.raises(ValueError, match=f"{complaint}$"):
        load(tmp_path / "bad.npz", load_scene())


@pytest.mark.parametrize(
    ("told", "complaint"),
    [
        (
            {"roots": "false"},
            r"its roots are 'false' with channels .*; allowed: true with \"todo\" among them, or false",
        ),
        ({"roots": True, "observation": {**SEEN, "channels": ["height", "walls"]}}, "its roots are True with channels"),
        *(({"mirror": value}, f"its mirror is {value!r}; allowed: true, false") for value in (1.5, "yes", None)),
        *(
            ({"fineness": value}, f"its fineness is {value!r}; allowed: a number from 0 to 10")
            for value in ("fine", -1.0, 11.0, None)
        ),
        ({"strides": [0]}, ".*"),
        ({"frames": None}, ".*"),
        ({"hidden": "1"}, ".*"),
        ({"observation": {"channels": ["height", "todo"]}}, ".*"),
    ],
)
def test_metadata_that_makes_no_sense_is_refused(told, complaint, tmp_path):
    (tmp_path / "bad.npz").write_bytes(written(weights(), {**METADATA, **told}))
    with pytest.raises(ValueError, match=f"policy .*bad.npz is damaged or no policy: {complaint}"):
        load(tmp_path / "bad.npz", load_scene())


def test_an_array_under_the_wrong_name_is_no_policy(tmp_path):
    np.save(tmp_path / "it.npy", np.zeros(3))
    (tmp_path / "it.npy").rename(tmp_path / "it.npz")
    with pytest.raises(ValueError, match=r"is damaged or no policy: it cannot be read as a .npz of plain arrays$"):
        load(tmp_path / "it.npz", load_scene())


def test_actions_end_at_one():
    policy = read(weights(drive=(-3.0, 0.5, 3.0)), METADATA)
    seen = {"patch": np.zeros((1, 2, 8, 8), np.float32), "pose": np.zeros((1, 15), np.float32)}
    assert policy.act_all(seen).tolist() == [[-1.0, 0.5, 1.0]]


def test_an_observation_of_another_kind_is_refused_in_words(pusher):
    policy = load(pusher, load_scene())
    seen = {"patch": np.zeros((2, 8, 8), np.float32), "pose": np.zeros(15, np.float32)}
    assert policy.act(seen).shape == (3,)
    with pytest.raises(
        ValueError, match=r"patch of the observation is \(3, 8, 8\); allowed for this policy: \(2, 8, 8\)"
    ):
        policy.act(seen | {"patch": np.zeros((3, 8, 8), np.float32)})
    with pytest.raises(
        ValueError, match=r"overview of the observation is missing; allowed for this policy: \(2, 12, 12\)"
    ):
        load_policy("ppo", load_scene()).act(seen | {"patch": np.zeros((2, 16, 16), np.float32)})


def test_a_policy_that_does_not_see_obstacles_warns_where_there_can_be_any(pusher):
    with pytest.warns(UserWarning, match="posts can have obstacles, and policy pusher does not see them"):
        load(pusher, load_scene("posts"))


def test_a_policy_under_grade_control_is_refused_on_cells():
    with pytest.raises(ValueError, match=r'terrain is "voxel"; allowed with policy ppo, which needs grade control'):
        load_policy("ppo", load_scene(terrain="voxel"))
