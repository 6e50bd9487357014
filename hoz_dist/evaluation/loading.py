"""From a run's configuration, parameters and graphs to an agent; from a split to rooms."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hoz_dist.config import RunConfig
from hoz_dist.errors import InvalidValueError, NotFoundError
from hoz_dist.evaluation.agents import PolicyAgent
from hoz_dist.evaluation.protocol import TEMPERATURE
from hoz_dist.graph.scene_graph import SceneGraph
from hoz_dist.nav.encoder import VisualEncoder
from hoz_dist.policy.encoders import load_encoder
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.parameters import FlatParameters, check_fit, make_policy


def load_agent(
    config: RunConfig,
    parameters: NDArray[np.float32],
    graphs: Mapping[str, SceneGraph],
    temperature: float = TEMPERATURE,
) -> PolicyAgent:
    """Make the agent that a checkpoint holds.

    Args:
        config: Configuration of the run.
        parameters: [P].
        graphs: Scene graphs, by scene.
        temperature: By which logits are divided before actions are drawn.

    Raises:
        InvalidValueError: The parameters are not those of the configuration's network.
        NotFoundError: The method is guided by graphs and there is none.
    """
    policy = make_policy(config.policy, config.seed)
    flat = FlatParameters(policy)
    check_fit(parameters.size, flat.values.numel())
    flat.load(parameters)
    if config.policy.zone_layer and not graphs:
        message = "The checkpoint holds no scene graph, so its agent has nothing to be guided by; train longer."
        raise NotFoundError(message)
    bank = GraphBank.of(graphs, config.zones, config.edge_cost, config.subgoal)
    return PolicyAgent(config.method, policy.eval(), bank, temperature)


def matching_encoder(config: RunConfig, weights: Path | None) -> VisualEncoder:
    """Load the visual encoder that a run was trained with.

    Raises:
        InvalidValueError: The weights are not those of the run.
    """
    encoder = load_encoder(config.encoder, weights)
    if encoder.key != config.encoder_key:
        message = f"The run's encoder is {config.encoder_key}, not {encoder.key}; give the same file to --weights."
        raise InvalidValueError(message)
    return encoder
