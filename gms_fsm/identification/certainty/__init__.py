"""How sure a fit is: profiles, regions, bootstraps, scores."""
