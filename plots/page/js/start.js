"use strict";
// A replay page shows the data it was written with.
load(data);
