"""`dirt-push record`: a data set of Minari holds what the scene shows, plays again to the same bits, and is whole."""

import signal
import sys

import numpy as np
import pytest

from dirt_env.cli import main
from dirt_env.config import load
from dirt_env.split import TRAINING

minari = pytest.importorskip("minari")

NOISY = ["--set", "observation.noise.height=0.05", "--set", "observation.noise.position=0.1"]
LEARNER = """
import numpy as np

class Learner:
    '''Sees another patch than the scene's, and steers by it.'''
    sees = "patch"
    observation = {"size": 8, "channels": ["height"]}
    def __init__(self, config): pass
    def reset(self, seed=None): pass
    def act(self, observation):
        assert observation["patch"].shape == (1, 8, 8)
        return [3.0 * observation["patch"].mean(), 1.7, -0.1]

class Graded(Learner):
    '''Means its blade by grade control.'''
    action = {"blade": "grade"}

class Impatient(Learner):
    '''Gets Ctrl-C in its episode `last`, the first being 1.'''
    observation, last, episodes = {}, 2, 0
    def reset(self, seed=None):
        self.episodes += 1
    def act(self, observation):
        if self.episodes == self.last:
            raise KeyboardInterrupt
        return np.zeros(3)

class Hasty(Impatient):
    last = 1
"""


def record(folder, *arguments, episodes=2, steps=30):
    """The data set that the command has written."""
    numbers = ["--episodes", str(episodes), "--steps", str(steps), "--out", str(folder), "--dataset", "test-v0"]
    assert main(["record", *numbers, *arguments]) == 0
    return minari.MinariDataset(folder / "test-v0" / "data")


def assert_replays(data):
    """The environment that the data set names gives the same again, to the last bit."""
    env = data.recover_environment()
    for episode in data:
        seed = next(iter(data.storage.get_episode_metadata([episode.id])))["seed"]
        observation, info = env.reset(seed=seed)
        for step in range(len(episode.actions) + 1):
            assert observation.keys() == episode.observations.keys()
            for name, array in observation.items():
                assert array.tobytes() == episode.observations[name][step].tobytes(), (name, step)
            for name in info.keys() - {"reward"}:
                assert info[name] == episode.infos[name][step], (name, step)
            if step == len(episode.actions):
                break
            observation, reward, terminated, truncated, info = env.step(episode.actions[step])
            ends = episode.rewards[step], episode.terminations[step], episode.truncations[step]
            assert (reward, terminated, truncated) == ends
            for name, value in info["reward"].items():
                assert value == episode.infos["reward"][name][step + 1]


@pytest.mark.slow
@pytest.mark.parametrize("more", [[], NOISY, ["--level", "2"], ["--scene", "posts"]])
def test_it_plays_again_to_the_same_bits(more, tmp_path):
    data = record(tmp_path, "--policy", "adaptive_push", *more)
    assert (data.total_episodes, data.total_steps) == (2, 60)
    assert_replays(data)


@pytest.mark.parametrize("more", [[], NOISY])
def test_the_map_that_a_policy_needs_is_recorded_only_where_it_is_asked_for(more, tmp_path):
    without = record(tmp_path / "a", "--policy", "adaptive_push", *more)
    assert set(without.observation_space) == {"patch", "pose"}
    asked = record(tmp_path / "b", "--policy", "adaptive_push", "--set", "observation.map=true", *more)
    assert set(asked.observation_space) == {"patch", "pose", "map"}
    for one, other in zip(without, asked, strict=True):
        assert one.actions.tobytes() == other.actions.tobytes()
        assert one.observations["patch"].tobytes() == other.observations["patch"].tobytes()


def test_a_learned_policy_sees_its_own_patch_and_the_scenes_is_recorded(tmp_path, monkeypatch):
    (tmp_path / "learner.py").write_text(LEARNER)
    monkeypatch.chdir(tmp_path)
    data = record(tmp_path, "--policy", "learner:Learner", *NOISY)
    assert data.observation_space["patch"].shape == (2, 32, 32)
    assert {episode.actions.dtype.name for episode in data} == {"float32"}
    assert all(np.abs(episode.actions).max() <= 1.0 for episode in data)
    assert_replays(data)  # so actions were played as they are kept, though the policy's are others


def test_actions_are_played_again_as_the_policy_means_them(tmp_path, monkeypatch):
    (tmp_path / "learner.py").write_text(LEARNER)
    monkeypatch.chdir(tmp_path)
    data = record(tmp_path, "--policy", "learner:Graded")
    assert data.env_spec.kwargs["scene"]["action"] == {"blade": "grade"}
    assert_replays(data)


def test_layouts_are_those_of_training_unless_said_otherwise(tmp_path):
    def seeds(*arguments, folder):
        data = record(folder, "--policy", "idle", *arguments, steps=2)
        return [one["seed"] for one in data.storage.get_episode_metadata(range(2))]

    assert seeds(folder=tmp_path / "a") == list(TRAINING[:2])
    assert seeds("--skip", "2", folder=tmp_path / "b") == list(TRAINING[2:4])
    assert seeds("--split", "selection", folder=tmp_path / "c") == [8000, 8001]


def test_what_it_says_of_itself(tmp_path, capsys, monkeypatch):
    data = record(tmp_path, "--policy", "random", "--level", "0", steps=5)
    metadata = data.storage.metadata
    assert (metadata["dataset_id"], metadata["algorithm_name"]) == ("test-v0", "random")
    assert load(data.env_spec.kwargs["scene"]) == load("heap", level=0)
    assert data.env_spec.max_episode_steps == 5
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("random in heap: 2 episodes, 10 steps, ")
    assert said[1] == f"wrote {tmp_path / 'test-v0'}"
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert list(minari.list_local_datasets()) == ["test-v0"]
    returns = [one["rewards_sum"] for one in data.storage.get_episode_metadata(range(2))]
    assert returns == pytest.approx([episode.rewards.sum() for episode in data])


def test_without_out_it_lies_where_minari_looks(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert main(["record", "--policy", "idle", "--level", "1", "--episodes", "1", "--steps", "2"]) == 0
    assert minari.load_dataset("heap-1/idle-v0").total_steps == 2


def test_ctrl_c_keeps_whole_episodes(tmp_path, capsys, monkeypatch):
    (tmp_path / "learner.py").write_text(LEARNER)
    monkeypatch.chdir(tmp_path)
    numbers = ["--episodes", "3", "--steps", "4", "--out", "sets", "--dataset", "test-v0"]
    assert main(["record", "--policy", "learner:Hasty", *numbers]) == 130
    said = "dirt-push: interrupted before the first episode was finished: nothing written\n"
    assert capsys.readouterr() == ("", said)
    assert list((tmp_path / "sets").iterdir()) == []
    assert main(["record", "--policy", "learner:Impatient", *numbers]) == 130
    assert capsys.readouterr().err == "dirt-push: interrupted after 1 of 3 episodes\n"
    assert [path.name for path in (tmp_path / "sets").iterdir()] == ["test-v0"]
    data = minari.MinariDataset(tmp_path / "sets" / "test-v0" / "data")
    assert (data.total_episodes, data.total_steps) == (1, 4)


def test_ctrl_c_waits_until_an_episode_is_written(tmp_path, capsys, monkeypatch):
    from dirt_env.record import DataSet

    add = DataSet.add

    def pressed(self, episode):
        signal.raise_signal(signal.SIGINT)
        add(self, episode)

    monkeypatch.setattr(DataSet, "add", pressed)
    numbers = ["--episodes", "3", "--steps", "4", "--out", str(tmp_path), "--dataset", "test-v0"]
    assert main(["record", "--policy", "idle", *numbers]) == 130
    captured = capsys.readouterr()
    assert captured.err == "dirt-push: interrupted after 1 of 3 episodes\n"
    assert captured.out.startswith("idle in heap: 1 episodes, 4 steps")
    data = minari.MinariDataset(tmp_path / "test-v0" / "data")
    assert (data.total_episodes, data.total_steps, len(list(data))) == (1, 4, 1)


def test_an_error_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("dirt_env.env.DirtPushEnv.step", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["record", "--policy", "idle", "--out", str(tmp_path)])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--dataset", "no version"], "--dataset is 'no version'; allowed: [NAMESPACE/]NAME-vNUMBER"),
        (["--dataset", "nameless"], "--dataset is 'nameless'; allowed: [NAMESPACE/]NAME-vNUMBER"),
        (["--dataset", "../up-v0"], "--dataset is '../up-v0'; allowed: [NAMESPACE/]NAME-vNUMBER"),
        (["--dataset", "taken-v0"], "taken-v0 is there; allowed: a new name"),
        (["--skip", "8000"], "layouts is 8010; allowed: 1 to 8000 of training"),
        (["--policy", "clever"], "policy is 'clever'; known: "),
        (["--set", "soil.repos=3"], "repose"),
        (["--policy", "ppo", "--set", "action.blade=tracks"], "action.blade is 'tracks'; allowed with policy ppo"),
    ],
)
def test_bad_input_is_one_clear_line(arguments, words, tmp_path, capsys):
    (tmp_path / "taken-v0").mkdir()
    assert main(["record", "--policy", "idle", *arguments, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["taken-v0"]


def test_without_minari_it_says_what_to_install(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "minari.storage", None)
    assert main(["record"]) == 2
    assert 'pip install ".[record]"' in capsys.readouterr().err
