"""Statements about charts, proved from guards and flows, or refuted by an example."""
