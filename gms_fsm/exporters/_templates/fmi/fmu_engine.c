/* $title: the engine of gms-fsm $version, with located switches.
 * Compile it with -ffp-contract=off and without -ffast-math: the results are then those of gms-fsm
 * to the last bit. Everything that changes is in the block. */
#include <string.h>
#include "model.h"
$engine
typedef union { double f; int64_t i; bool b[8]; } word;

/* All that is not zero at the start. */
void ${name}_start(char *block)
{
    word *w = (word *)block;
    memset(block, 0, $words * sizeof *w);
$image
}

/* What follows from parameters. */
void ${name}_derive(char *block)
{
    word *w = (word *)block;
    w[$time_scale].f = fmu_adapt(block);
}

/* One step of Co-Simulation. */
int64_t ${name}_step(char *block) { return fmu_step(block); }

/* Model Exchange. */
void ${name}_restart(char *block) { fmu_restart(block); }
int64_t ${name}_settle(char *block) { return fmu_settle(block); }
void ${name}_slope(char *block) { fmu_slope(block); }
void ${name}_indicate(char *block) { fmu_indicate(block); }
int64_t ${name}_changed(char *block) { return fmu_changed(block); }
void ${name}_observe(char *block) { fmu_observe(block); }
