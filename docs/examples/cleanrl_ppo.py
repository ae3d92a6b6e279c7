"""PPO in one file, in the style of CleanRL: nothing but gymnasium, its wrappers, numpy and torch.

    python docs/examples/cleanrl_ppo.py                              # a shove of a few metres, learned in seconds
    python docs/examples/cleanrl_ppo.py --job heap --steps 3000000   # the default job, level 0

Nothing here knows DirtPush but the names in `JOBS`. It ends with a number that it holds itself to.
"""

import argparse
import time

import gymnasium as gym
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

ENV_ID = "dirt_env:DirtPush-v0"
SMALL = {"observation": {"size": 8, "resolution": 1.0}}
SHOVE = {  # one heap between the machine and the goal, all in a line
    "site": {"size": [16.0, 16.0]},
    "start": [{"region": {"kind": "circle", "center": [6.5, 8.0], "radius": 1.5}, "volume": [0.9, 1.1]}],
    "goal": [{"region": {"kind": "rectangle", "center": [11.5, 8.0], "size": [6.0, 6.0]}}],
    "machine": {"pose": [3.0, 8.0, 0.0]},
}
JOBS = {
    "shove": {"scene": SHOVE, "max_episode_steps": 40, **SMALL},
    "heap": {"scene": "heap", "level": 0, "observation": {"size": 16, "resolution": 1.0}},
}


def read_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--job", choices=JOBS, default="shove")
    parser.add_argument("--steps", type=int, default=24_576, help="of all environments together")
    parser.add_argument("--num-envs", type=int, default=8)
    parser.add_argument("--num-steps", type=int, default=128, help="of each environment for an update")
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--minibatches", type=int, default=8)
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--gamma", type=float, default=0.98)
    parser.add_argument("--gae-lambda", type=float, default=0.95)
    parser.add_argument("--clip", type=float, default=0.2)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def make_env(job: dict, gamma: float):
    def thunk() -> gym.Env:
        env = gym.make(ENV_ID, **job)
        env = gym.wrappers.FlattenObservation(env)
        env = gym.wrappers.RecordEpisodeStatistics(env)
        env = gym.wrappers.ClipAction(env)
        env = gym.wrappers.NormalizeReward(env, gamma=gamma)
        return gym.wrappers.TransformReward(env, lambda reward: np.clip(reward, -10.0, 10.0))

    return thunk


def linear(inputs: int, outputs: int, gain: float = 2.0**0.5) -> nn.Linear:
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


class Agent(nn.Module):
    def __init__(self, inputs: int, actions: int) -> None:
        super().__init__()
        self.critic = nn.Sequential(linear(inputs, 64), nn.Tanh(), linear(64, 64), nn.Tanh(), linear(64, 1, 1.0))
        self.actor = nn.Sequential(linear(inputs, 64), nn.Tanh(), linear(64, 64), nn.Tanh(), linear(64, actions, 0.01))
        self.log_std = nn.Parameter(torch.full((1, actions), -0.3))

    def distribution(self, observation: torch.Tensor) -> Normal:
        mean = self.actor(observation)
        return Normal(mean, self.log_std.exp().expand_as(mean))


def advantages_of(rewards, values, dones, last_value, gamma, gae_lambda) -> torch.Tensor:
    """Generalised advantage estimation; `dones[t]` says whether step t was its episode's last."""
    advantages, ahead, following = torch.zeros_like(rewards), torch.zeros_like(last_value), last_value
    for t in reversed(range(len(rewards))):
        goes_on = 1.0 - dones[t]
        error = rewards[t] + gamma * following * goes_on - values[t]
        ahead = error + gamma * gae_lambda * goes_on * ahead
        advantages[t], following = ahead, values[t]
    return advantages


def update(agent: Agent, optimizer, batch: dict[str, torch.Tensor], args: argparse.Namespace) -> None:
    size = len(batch["observations"])
    for _ in range(args.epochs):
        for part in torch.randperm(size).split(size // args.minibatches):
            observations = batch["observations"][part]
            distribution = agent.distribution(observations)
            ratio = (distribution.log_prob(batch["actions"][part]).sum(1) - batch["log_probs"][part]).exp()
            advantage = batch["advantages"][part]
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            clipped = ratio.clamp(1.0 - args.clip, 1.0 + args.clip)
            policy_loss = -torch.min(advantage * ratio, advantage * clipped).mean()
            value_loss = 0.5 * (agent.critic(observations).flatten() - batch["returns"][part]).pow(2).mean()
            optimizer.zero_grad()
            (policy_loss + 0.5 * value_loss).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()


def train(args: argparse.Namespace) -> Agent:
    torch.manual_seed(args.seed)
    job = JOBS[args.job]
    envs = gym.vector.SyncVectorEnv(
        [make_env(job, args.gamma) for _ in range(args.num_envs)], autoreset_mode=gym.vector.AutoresetMode.SAME_STEP
    )
    agent = Agent(envs.single_observation_space.shape[0], envs.single_action_space.shape[0])
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    observation = torch.as_tensor(envs.reset(seed=args.seed)[0])
    updates = args.steps // (args.num_envs * args.num_steps)
    begun, returns = time.perf_counter(), []
    for number in range(updates):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1.0 - number / updates)
        names = ("observations", "actions", "log_probs", "values", "rewards", "dones")
        rows: dict[str, list[torch.Tensor]] = {name: [] for name in names}
        for _ in range(args.num_steps):
            with torch.no_grad():
                distribution = agent.distribution(observation)
                action, value = distribution.sample(), agent.critic(observation).flatten()
            following, reward, terminated, truncated, infos = envs.step(action.numpy())
            done = torch.as_tensor(terminated | truncated, dtype=torch.float32)
            log_prob, reward = distribution.log_prob(action).sum(1), torch.as_tensor(reward, dtype=torch.float32)
            for name, row in zip(names, (observation, action, log_prob, value, reward, done), strict=True):
                rows[name].append(row)
            observation = torch.as_tensor(following)
            if "final_info" in infos:
                episode = infos["final_info"]["episode"]
                returns += episode["r"][infos["final_info"]["_episode"]].tolist()
        batch = {name: torch.stack(column) for name, column in rows.items()}
        with torch.no_grad():
            last = agent.critic(observation).flatten()
            rest = batch["rewards"], batch["values"], batch["dones"], last, args.gamma, args.gae_lambda
            batch["advantages"] = advantages_of(*rest)
        batch["returns"] = batch["advantages"] + batch["values"]
        update(agent, optimizer, {name: column.flatten(0, 1) for name, column in batch.items()}, args)
        steps = (number + 1) * args.num_envs * args.num_steps
        rate = steps / (time.perf_counter() - begun)
        print(f"{steps:>9,} steps, {rate:6,.0f} a second, return {np.mean(returns[-20:] or [np.nan]):7.3f}")
    envs.close()
    return agent


def share_in_goal(agent: Agent, job: dict, layouts: int = 5) -> float:
    """Mean share of the soil that the mean actions bring into the goal, on layouts that were not trained on."""
    env = gym.wrappers.ClipAction(gym.wrappers.FlattenObservation(gym.make(ENV_ID, **job)))
    shares = []
    for seed in range(8000, 8000 + layouts):
        observation, info = env.reset(seed=seed)
        done = False
        while not done:
            with torch.no_grad():
                action = agent.actor(torch.as_tensor(observation)).numpy()
            observation, _, terminated, truncated, info = env.step(action)
            done = terminated or truncated
        shares.append(info["share_in_goal"])
    return float(np.mean(shares))


if __name__ == "__main__":
    args = read_arguments()
    share = share_in_goal(train(args), JOBS[args.job])
    print(f"{share:.0%} of the soil in the goal")
    assert args.job != "shove" or share > 0.6, f"learned too little: {share:.2f}"
