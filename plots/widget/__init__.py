"""The widget that explores runs in a notebook (extra ``jupyter``): `plots.explore`."""
