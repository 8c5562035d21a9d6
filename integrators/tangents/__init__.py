"""The variational equations along a run, and what a switch does to them: the loop knows neither."""
