"""Muon for the matrices of dense layers and Adam for all else, as one optimiser.

Jordan and others, "Muon: An optimizer for hidden layers in neural networks" (2024): a step is the running mean of the
gradient with all its singular values made equal, so that what is rarely seen is learned as quickly as what is common.
"""

from collections.abc import Iterable
from typing import Any

import torch

from .hyperparameters import MUON_FROM


class MuonAndAdam:
    """Both optimisers as the one that stable-baselines3's PPO asks for, in an update, `save` and `load`.

    Muon takes matrices of MUON_FROM rows and columns or more. Its steps are scaled to be about as large as Adam's with
    the same learning rate, however long the gradients are. `adam`: options of Adam.
    """

    def __init__(self, parameters: Iterable[torch.nn.Parameter], lr: float, **adam: Any) -> None:
        """Deal out the parameters."""
        parts: dict[bool, list[torch.nn.Parameter]] = {False: [], True: []}
        for one in parameters:
            parts[one.ndim == 2 and min(one.shape) >= MUON_FROM].append(one)
        self.muon = torch.optim.Muon(parts[True], lr, weight_decay=0.0, adjust_lr_fn="match_rms_adamw")
        self.adam = torch.optim.Adam(parts[False], lr, **adam)

    @property
    def param_groups(self) -> list[dict[str, Any]]:
        """Where the learning rate is set. Asked for anew each time: `load_state_dict` of either makes new groups."""
        return self.muon.param_groups + self.adam.param_groups

    def zero_grad(self) -> None:
        """Forget the gradients."""
        self.muon.zero_grad()
        self.adam.zero_grad()

    def step(self) -> None:
        """One step of each."""
        self.muon.step()
        self.adam.step()

    def state_dict(self) -> dict[str, Any]:
        """What both remember."""
        return {"muon": self.muon.state_dict(), "adam": self.adam.state_dict()}

    def load_state_dict(self, state: dict[str, Any], strict: bool = True) -> None:
        """Go on from what `state_dict` gave; stable-baselines3 says `strict` to all but torch's own optimisers."""
        self.muon.load_state_dict(state["muon"])
        self.adam.load_state_dict(state["adam"])
