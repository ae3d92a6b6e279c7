"""The hyperparameters of each algorithm, with their defaults and ranges; those of stable-baselines3 by its names."""

from dataclasses import dataclass

from dirt_env.config.rules import Choice, Either, Flag, Number, Table

MUON_FROM = 8  # rows and columns of a matrix that Muon takes; what gives the few actions or the value is left to Adam

FROM_ONE = Number(1, whole=True)
POSITIVE = Number(0, above=True)
RATE = Number(0, 1, above=True)
SHARE = Number(0, 1)
AUTO = Choice(("auto",))


@dataclass(frozen=True)
class Ppo:
    """Hyperparameters of PPO: those of stable-baselines3, and four more.

    `final_rate` is a share of `learning_rate`. With a `log_std_final` the logarithm of the actions' deviation is not
    learned but falls evenly to that. `optimizer` "muon" takes Muon for the matrices of dense layers, and Adam for the
    rest (agents/optimiser.py). With `share_features` actor and critic see through the same convolutions and first dense
    layer, without it each through its own.
    """

    n_steps: int = 32
    batch_size: int = 2048
    n_epochs: int = 4
    optimizer: str = "adam"
    share_features: bool = True
    learning_rate: float = 5e-4
    final_rate: float = 0.1
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5
    target_kl: float = 0.03
    log_std_init: float = -0.3
    log_std_final: float | None = None

    @property
    def steps_of_a_world(self) -> int:
        """From one update to the next."""
        return self.n_steps


@dataclass(frozen=True)
class Sac:
    """Hyperparameters of SAC: those of stable-baselines3, and `memory`, what the buffer may take, in GB.

    Every `train_freq` steps of each world there are `gradient_steps` updates, each from `batch_size` steps out of the
    last `buffer_size`; steps are those of all worlds together.
    """

    buffer_size: int = 150_000
    learning_starts: int = 20_000
    batch_size: int = 256
    train_freq: int = 1
    gradient_steps: int = 8
    learning_rate: float = 3e-4
    gamma: float = 0.99
    tau: float = 0.005
    ent_coef: float | str = "auto"
    target_entropy: float | str = "auto"
    memory: float = 2.0

    @property
    def steps_of_a_world(self) -> int:
        """From one update to the next."""
        return self.train_freq


PPO = Table(
    Ppo,
    {
        "n_steps": FROM_ONE,
        "batch_size": Number(2, whole=True),
        "n_epochs": FROM_ONE,
        "optimizer": Choice(("adam", "muon")),
        "share_features": Flag(),
        "learning_rate": RATE,
        "final_rate": SHARE,
        "gamma": SHARE,
        "gae_lambda": SHARE,
        "clip_range": POSITIVE,
        "ent_coef": Number(0),
        "vf_coef": Number(0),
        "max_grad_norm": POSITIVE,
        "target_kl": POSITIVE,
        "log_std_init": Number(-5, 2),
        "log_std_final": Number(-5, 2),
    },
)
SAC = Table(
    Sac,
    {
        "buffer_size": FROM_ONE,
        "learning_starts": Number(0, whole=True),
        "batch_size": Number(2, whole=True),
        "train_freq": FROM_ONE,
        "gradient_steps": FROM_ONE,
        "learning_rate": RATE,
        "gamma": SHARE,
        "tau": Number(0, 1, above=True),
        "ent_coef": Either(AUTO, Number(0), "a number >= 0"),
        "target_entropy": Either(AUTO, Number(), "a number"),
        "memory": POSITIVE,
    },
)
ALGORITHMS = {"ppo": PPO, "sac": SAC}
