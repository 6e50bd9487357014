"""Settings of Zenoh that all our sessions share, as paths in its configuration.

They follow what was measured: no multicast (container networks have none), retries from 200 ms to 2 s (the default
takes 3.4 s to come back), short leases, a queue that holds a whole shard of parameters.
"""

from pathlib import PurePath
from typing import Any, Final

SERVICE_LEASE_MS: Final = 2000
"""Routers and learners: one that is silent for so long is given up, so that a standby takes over soon."""
CLIENT_LEASE_MS: Final = 5000
"""Actors and clients: they may be behind a link that loses packets, and stand still for seconds."""

_WAIT: Final = "transport/link/tx/queue/congestion_control/block/wait_before_close"
"""How long a send waits for a receiver that takes nothing before it closes the connection, microseconds."""
_ROUTER_WAIT_US: Final = 1_500_000
"""Less than the lease. While a router waits for one client it does not hear the one whose message it forwards: with a
wait of 10 s, a client that stood still with 16 MB on the way held up all others for 6.5 s, and the learner was given up
as silent; with 1.5 s, for 1.5 s, and nobody was. A client at 0.6 Mbit/s still gets shards of 480 KiB."""
_CLIENT_WAIT_US: Final = 5_000_000
"""A client waits in its own thread alone, and a slow link may take nothing for seconds. Not longer: a client with 40 MB
on the way to a router that stood still for 6 s was back at once with 5 s, and after 10 s with 10 s."""

_COMMON: Final[dict[str, Any]] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "scouting/delay": 0,  # nothing is scouted for; a router would wait half a second for it all the same
    # On where it is wanted; see `shared_memory_settings`.
    "transport/shared_memory/enabled": False,
    # The priority of questions and answers. 16 batches of 64 KiB, Zenoh's limit, hold the two shards of 480 KiB that
    # may be on their way to a client: a router that forwards them to a client that stands still must not wait for it,
    # because everybody else would wait too.
    "transport/link/tx/queue/size/data": 16,
    "transport/link/rx/buffer_size": 4 * 1024 * 1024,
    "transport/link/rx/max_message_size": 128 * 1024 * 1024,
}


def router_settings() -> dict[str, Any]:
    """Return the settings of a router, less its endpoints and keys."""
    return _COMMON | {
        "mode": "router",
        "listen/exit_on_failure": True,
        "listen/timeout_ms": 0,
        "transport/link/tx/lease": SERVICE_LEASE_MS,
        _WAIT: _ROUTER_WAIT_US,
        # zenohd, unlike us, answers questions about itself unless told not to.
        "adminspace/permissions": {"read": False, "write": False},
    }


def client_settings(lease_ms: int) -> dict[str, Any]:
    """Return the settings of a router's client, less its endpoint and keys."""
    return _COMMON | {
        "mode": "client",
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 2},
        "transport/link/tx/lease": lease_ms,
        _WAIT: _CLIENT_WAIT_US,
    }


def shared_memory_settings() -> dict[str, Any]:
    """Return the settings with which a session takes messages through shared memory.

    Only those that a sender puts there: Zenoh's own choice of messages knows no bound and no fall-back of ours.
    """
    return {
        "transport/shared_memory/enabled": True,
        "transport/shared_memory/transport_optimization/enabled": False,
    }


def tls_settings(authority: PurePath, certificate: PurePath, key: PurePath) -> dict[str, Any]:
    """Return the settings with which a session, router or client, shows its key and checks that of the other side.

    Args:
        authority: File of the certificate of the authority that must have signed the other side's.
        certificate: File of one's own certificate.
        key: File of its private key.
    """
    return {
        "transport/link/tls": {
            "root_ca_certificate": str(authority),
            "enable_mtls": True,
            "listen_certificate": str(certificate),
            "listen_private_key": str(key),
            "connect_certificate": str(certificate),
            "connect_private_key": str(key),
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }
    }
