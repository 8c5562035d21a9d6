"""The included friction models, one per module: bristles, sliding, joints."""
