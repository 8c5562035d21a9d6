/* $title.
 *
 * Written by gms-fsm $version. Compile ${name}.c with -ffp-contract=off, and not with
 * -ffast-math: then the results are those of gms-fsm to the last bit.
 *
 * Everything is in SI units. Inputs: $inputs. Switches are located inside the calls.
 * There is no heap and there are no globals: everything is in ${name}_state, which may be copied.
 */
#ifndef $guard
#define $guard

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Private: what the engine keeps from call to call, and the room that it works in. */
$engine

typedef struct {
    double t; /* s, the present time */
$fields
    int64_t switches; /* since ${name}_init */
    int64_t logged;   /* switches in the log: those of the last call, or the last of them if there
                         were $log_length or more */
    ${name}_engine engine; /* private */
    ${name}_engine before; /* private: to return to after an error */
} ${name}_state;

/* What the functions return. */
enum {
    ${name}_OK = 0,
    ${name}_BAD_ARGUMENT = $bad_argument,
$codes
};
$parameters
/* States of the elements. */
enum {
$states
};
$edges
/* A limit of steps for those who need none. */
enum { ${name}_MAX_STEPS = $max_steps };

/* Begin at t = $t_start s. */
void ${name}_init(${name}_state *s);

/* Advance by dt >= 0. During the call each input runs on a straight line:$both
 * its value at the start and at the end. With dt = 0 the outputs are those at the end.
 * max_steps limits the work: no more steps are attempted than that (between two of them an element
 * switches at most 100 times), and ${name}_TOO_MANY_STEPS is returned instead.
 * Returns ${name}_OK, or an error: then the state is what it was before the call. */
int ${name}_advance(${name}_state *s, ${lines}double dt, int64_t max_steps);

/* The same, to the time t. */
int ${name}_advance_to(${name}_state *s, ${lines}double t, int64_t max_steps);

/* A parameter, by its name above; NAN for a number that is none. The rules of a parameter are not
 * checked. Tolerances that were not given follow, outputs in the next call; before the first step
 * initial values that depend on it do, too. */
double ${name}_get(const ${name}_state *s, int parameter);
int ${name}_set(${name}_state *s, int parameter, double value);

/* The k-th switch in the log: its time, element (over all contacts, from 0), edge. Without
 * 0 <= k < logged they are NAN, -1, -1. */
void ${name}_switch(const ${name}_state *s, int64_t k, double *t, int64_t *element, int64_t *edge);

const char *${name}_edge(int64_t edge);
const char *${name}_message(int code);

#ifdef __cplusplus
}
#endif

#endif
