"""The torch renderer that all stages share: coverage, view weights, gather, transport, direct light."""
