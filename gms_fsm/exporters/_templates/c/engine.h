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

typedef union { double f; int64_t i; bool b[8]; } ${name}_word;

typedef struct {
    double t; /* s, the present time */
$fields
    int64_t switches; /* since ${name}_init */
    int64_t logged;   /* switches in the log: those of the last call, or the last of them if there
                         were $log_length or more */
    ${name}_word word[$words]; /* private */
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
/* Begin at t = $t_start s. */
void ${name}_init(${name}_state *s);

/* Advance by dt >= 0. During the call each input runs on a straight line:$both
 * its value at the start and at the end. With dt = 0 the outputs are those at the end.
 * Returns ${name}_OK. After ${name}_BAD_ARGUMENT nothing has changed; after any other
 * error the state is unusable: keep a copy of the struct if you want to go back. */
int ${name}_advance(${name}_state *s, ${lines}double dt);

/* The same, to the time t. */
int ${name}_advance_to(${name}_state *s, ${lines}double t);

/* A parameter, by its name above. Tolerances that were not given follow; before the first step
 * initial values that depend on it do, too. */
double ${name}_get(const ${name}_state *s, int parameter);
int ${name}_set(${name}_state *s, int parameter, double value);

/* The k-th switch in the log, 0 <= k < logged: its time, element (over all contacts), edge. */
void ${name}_switch(const ${name}_state *s, int64_t k, double *t, int64_t *element, int64_t *edge);

const char *${name}_edge(int64_t edge);
const char *${name}_message(int code);

#ifdef __cplusplus
}
#endif

#endif
