/* $title: the friction that a controller adds to its force.
 *
 * Compile what includes this as ${name}.c, with -ffp-contract=off: then the forces are those of
 * gms_fsm.Compensator to the last bit. Feedback $feedback, gain $gain.
 */
#ifndef ${guard}_COMPENSATOR_H
#define ${guard}_COMPENSATOR_H

#include "${name}.h"

typedef struct {
    ${name}_state friction;
    double v;     /* m/s, of the friction at the last tick */
    double force; /* N, to be added until the next tick */
} ${name}_compensator;

static inline void ${name}_compensator_init(${name}_compensator *c)
{
    ${name}_init(&c->friction);
    c->v = 0.0;
    c->force = 0.0;
}

/* Once a tick, every $period s. reference: the velocity that is wanted at the end of the sample
 * that begins$said. Returns ${name}_OK. After an error the force
 * is the last one, and the compensator must begin anew. */
static inline int ${name}_compensate(${name}_compensator *c, double reference$measured$arguments)
{
    const double v = $velocity;
    const int code = ${name}_advance(&c->friction, ${passed}$period, ${name}_MAX_STEPS);
    if (code == ${name}_OK) {
        const double force = $gain * c->friction.F;
        c->v = v;
        c->force = $force;
    }
    return code;
}

#endif
