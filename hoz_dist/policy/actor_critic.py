"""The actor-critic network of all methods: what acts, and what a rollout's gradient is computed through.

One network joins what the layers of a method give (`hoz_dist.policy.methods`); `PolicySettings` says which. Acting goes
step by step and decides which scene, zone and sub-goal to use (`act`); training goes over a whole rollout at once with
those decisions given, as it goes with the actions given (`unroll`).
"""

import torch
from torch import Tensor, nn
from torch.nn import functional

from hoz_dist.nav.actions import Action
from hoz_dist.nav.categories import TARGETS
from hoz_dist.nav.feedback import PREVIOUS_ACTIONS
from hoz_dist.nav.observation import Observation
from hoz_dist.policy.branches import BRANCHES, MAP_AXES
from hoz_dist.policy.graph_bank import GraphBank
from hoz_dist.policy.inputs import Inputs
from hoz_dist.policy.layers import DoneReminder, SceneLayer, ZoneLayer
from hoz_dist.policy.navigator import Guidance, ZoneState, guide, initial_zone_state
from hoz_dist.policy.recurrent import EpisodicLSTM
from hoz_dist.policy.settings import PolicySettings
from hoz_dist.policy.state import Decision, State, Unrolled
from hoz_dist.policy.steering import Memory, Moment, Steered
from hoz_dist.policy.steerings import STEERINGS
from hoz_dist.policy.tape import Tape
from hoz_dist.policy.trunks import make_trunk


class ActorCritic(nn.Module):
    """Policy and value function.

    Args:
        settings: What shapes the network.
    """

    def __init__(self, settings: PolicySettings) -> None:
        super().__init__()
        self.settings = settings
        sizes, categories = settings.sizes, len(TARGETS)
        branch = next((BRANCHES[layer] for layer in settings.layers if layer in BRANCHES), None)
        shape = () if branch is None else branch.shape(settings)
        maps = (shape[0], shape[1]) if len(shape) == MAP_AXES else None
        context = sizes.target + sizes.action
        context += sizes.zones * settings.zone_layer + settings.scenes * settings.scene_layer
        context += sum(shape) if maps is None else 0
        self.target_embedding = nn.Linear(categories, sizes.target)
        self.action_embedding = nn.Embedding(PREVIOUS_ACTIONS, sizes.action)
        self.trunk = make_trunk(settings, context, maps)
        self.object_branch = None if branch is None else branch.make(settings)
        self.scene_layer = (
            SceneLayer(self.trunk.picture_features, categories, settings.scenes) if settings.scene_layer else None
        )
        self.zone_layer = ZoneLayer(categories, sizes.zones) if settings.zone_layer else None
        self.lstm = EpisodicLSTM(self.trunk.features, sizes.lstm, sizes.lstm_layers)
        self.actor = nn.Linear(sizes.lstm, len(Action))
        self.critic = nn.Linear(sizes.lstm, 1)
        self.done_reminder = DoneReminder() if settings.done_reminder else None
        steering = next((STEERINGS[layer] for layer in settings.layers if layer in STEERINGS), None)
        self.steering = None if steering is None else steering(settings)
        with torch.no_grad():
            # Start near the uniform policy.
            self.actor.weight.mul_(0.1)
            self.actor.bias.zero_()

    @property
    def imitates(self) -> bool:
        """Whether a part of it is to be taught the expert's actions, which then have to be looked up."""
        return self.steering is not None and self.steering.imitates

    def initial_state(self, batch: int) -> State:
        """Return the state before any episode's first step."""
        memory = () if self.steering is None else self.steering.initial_memory(batch)
        return State(
            self.lstm.initial_state(batch),
            initial_zone_state(batch, self.settings.zones),
            memory,
            torch.zeros(batch, dtype=torch.bool),
        )

    def tape(self, steps: int, batch: int) -> Tape:
        """Return an empty tape for T steps of B episodes."""
        return self.lstm.tape(steps, batch, self.settings.precision)

    @torch.no_grad()
    def act(self, observation: Observation, state: State, bank: GraphBank, tape: Tape | None = None) -> Decision:
        """Perceive one step of B episodes, and say how to go on.

        Args:
            observation: [B, ...].
            state: State after the step before; that of an episode which begins is reset here.
            bank: Scene graphs; not used without the zone layer.
            tape: Where to record the step for `unroll`; None not to.
        """
        # For one step, copying the weights in a lower precision would cost more than it saves.
        tape = tape or self.lstm.tape(1, len(observation.first))
        inputs = Inputs.of(observation)
        first = torch.from_numpy(observation.first)
        with _products_in(tape.dtype):
            picture = self.trunk.see(inputs.features)
        scene_logits = self._scene_logits(picture, inputs)
        zone, guidance = state.zone, Guidance.nothing(len(first))
        embedding = None
        if self.zone_layer is not None:
            scene = torch.from_numpy(observation.scene)
            zone, guidance = guide(self.zone_layer, bank, zone, inputs.bag, inputs.target, scene_logits, scene, first)
            embedding = self.zone_layer(zone.nodes, bank.adjacency[guidance.scene, guidance.subgoal])
        joined = self._join(inputs, picture, scene_logits, embedding, tape.dtype)
        outputs = self.lstm.step(joined, first, state.lstm, tape)
        logits, value = self._heads(outputs, inputs)
        memory = state.memory
        if self.steering is not None:
            steered = self._steer(logits, outputs, inputs, first.unsqueeze(0), memory)
            logits, memory = steered.logits.squeeze(0), steered.memory
        target_seen = inputs.sees_target | (state.target_seen & ~first)
        return Decision(logits, value, State(tape.state, zone, memory, target_seen), guidance)

    def unroll(
        self, observation: Observation, state: State, guidance: Guidance, bank: GraphBank, tape: Tape | None = None
    ) -> Unrolled:
        """Run over a rollout, differentiably.

        Args:
            observation: [T, B, ...].
            state: State before the rollout's first step.
            guidance: What `act` decided at each step, [T, B].
            bank: The scene graphs that `act` used.
            tape: What `act` recorded of the rollout with the parameters as they are now, which is then not computed
                again; or an empty one to record it on. It must stay as it is until the gradient is computed.
        """
        steps, batch = observation.target.shape
        tape = self.tape(steps, batch) if tape is None else tape
        inputs = Inputs.of(observation)
        first = torch.from_numpy(observation.first)
        with _products_in(tape.dtype):
            picture = self.trunk.see(inputs.features)
        scene_logits = self._scene_logits(picture, inputs)
        zone, embedding = state.zone, None
        if self.zone_layer is not None:
            bags = inputs.bag.view(steps, batch, -1)
            nodes = self._nodes_over_time(self.zone_layer, bags, state.zone, guidance, bank)
            rows = bank.adjacency[guidance.scene.flatten(), guidance.subgoal.flatten()]
            embedding = self.zone_layer(nodes.flatten(0, 1), rows)
            zone = zone._replace(nodes=nodes[-1].detach(), scene=guidance.scene[-1])
        joined = self._join(inputs, picture, scene_logits, embedding, tape.dtype).view(steps, batch, -1)
        if tape.is_empty:
            self.lstm.record(joined, first, state.lstm, tape)
        outputs = self.lstm.differentiable(joined, tape)
        logits, values = self._heads(outputs.flatten(0, 1), inputs)
        steered = Steered(logits.view(steps, batch, -1), state.memory)
        if self.steering is not None:
            steered = self._steer(logits, outputs, inputs, first, state.memory)
        target_seen = _ever(inputs.sees_target.view(steps, batch), first, state.target_seen)
        return Unrolled(
            logits=steered.logits,
            values=values.view(steps, batch),
            scene_logits=None if scene_logits is None else scene_logits.view(steps, batch, -1),
            state=State(tape.state, zone, tuple(part.detach() for part in steered.memory), target_seen[-1]),
            imitation=steered.imitation,
            target_seen=target_seen,
        )

    def _scene_logits(self, picture: Tensor, inputs: Inputs) -> Tensor | None:
        if self.scene_layer is None:
            return None
        return self.scene_layer(self.trunk.summary(picture), inputs.confidence)  # type: ignore[no-any-return]

    def _nodes_over_time(
        self, layer: ZoneLayer, bags: Tensor, zone: ZoneState, guidance: Guidance, bank: GraphBank
    ) -> Tensor:
        """Return delta_t of every step, [T, B, K, N]; the gradient reaches lambda."""
        nodes, over_time = zone.nodes, []
        chosen = functional.one_hot(guidance.current, self.settings.zones).float()
        for t in range(len(bags)):
            fresh = guidance.fresh[t]
            if fresh.any():
                nodes = torch.where(fresh[:, None, None], bank.nodes[guidance.scene[t]], nodes)
            nodes = layer.update(nodes, bags[t], chosen[t])
            over_time.append(nodes)
        return torch.stack(over_time)

    def _join(
        self,
        inputs: Inputs,
        picture: Tensor,
        scene_logits: Tensor | None,
        zone_embedding: Tensor | None,
        dtype: torch.dtype,
    ) -> Tensor:
        context = [self.target_embedding(inputs.target), self.action_embedding(inputs.previous_action)]
        if scene_logits is not None:
            # The label trains the scene layer, the reward does not: it would bend the classifier.
            context.append(scene_logits.detach().softmax(dim=-1))
        if zone_embedding is not None:
            context.append(zone_embedding)
        objects = None
        if self.object_branch is not None:
            seen = self.object_branch(inputs.detections, inputs.appearance, inputs.target)
            if seen.ndim == 1 + MAP_AXES:
                objects = seen
            else:
                context.append(seen)
        with _products_in(dtype):
            return self.trunk(picture, objects, torch.cat(context, dim=1))  # type: ignore[no-any-return]

    def _heads(self, outputs: Tensor, inputs: Inputs) -> tuple[Tensor, Tensor]:
        logits = self.actor(outputs)
        if self.done_reminder is not None:
            logits = self.done_reminder(logits, inputs.confidence, inputs.target)
        return logits, self.critic(outputs).squeeze(-1)

    def _steer(self, logits: Tensor, outputs: Tensor, inputs: Inputs, first: Tensor, memory: Memory) -> Steered:
        """Let the steering have its say about all steps, [T, B]; its inputs may be flattened."""

        def over_time(values: Tensor) -> Tensor:
            return values.view(*first.shape, *values.shape[1:])

        moment = Moment(
            logits=over_time(logits),
            outputs=outputs.view(*first.shape, -1),
            features=over_time(inputs.features),
            previous_action=over_time(inputs.previous_action),
            first=first,
        )
        return self.steering(moment, memory, self.actor)  # type: ignore[no-any-return, misc]


def _ever(now: Tensor, first: Tensor, before: Tensor) -> Tensor:
    """Return whether something was true at any step of the episode so far, [T, B].

    Args:
        now: Whether it is true at a step, bool [T, B].
        first: Whether the step begins an episode, bool [T, B].
        before: Whether it was ever before the first step, bool [B].
    """
    over_time = []
    for here, begins in zip(now, first, strict=True):
        before = here | (before & ~begins)
        over_time.append(before)
    return torch.stack(over_time)


def _products_in(dtype: torch.dtype) -> torch.autocast:
    """Have products, and what follows from them element by element, in a type, for as long as the context lasts."""
    return torch.autocast("cpu", dtype, enabled=dtype != torch.float32)
