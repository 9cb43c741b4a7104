"""The handshake of requests, as ports have it: see `llfsm_verify.arrangement.requests`."""

from llfsm_verify.arrangement.requests import (
    ACTION_STATES,
    IDLE,
    SERVICE_STATES,
    STATES,
    UNDER_WAY,
    Request,
    RequestKind,
)

__all__ = ["ACTION_STATES", "IDLE", "SERVICE_STATES", "STATES", "UNDER_WAY", "Request", "RequestKind"]
