"""Motions that try what is in a chart: its edges, its pairs of edges, what decides its guards."""
