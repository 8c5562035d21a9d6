/* $title; see ${name}.h. Written by gms-fsm $version.
 *
 * First the functions of the system and of the integrator, in the order in which they are needed;
 * at the end those of the header. What cannot happen to this system has been left out: branches
 * that are never taken, and members of ${name}_engine that nothing reads. */
#include "${name}.h"

#include <string.h>
$engine
static const double LATEST = $latest; /* s: later, the clock would be too coarse */

static bool is_number(double u)
{
    return u - u == 0.0;
}

/* Copy what is public. */
static void show(${name}_state *s)
{
    const ${name}_engine *block = &s->engine;
    s->t = $clock;
$shown
}

void ${name}_init(${name}_state *s)
{
    ${name}_engine *block = &s->engine;
    memset(s, 0, sizeof *s);
$image
    show(s);
}

int ${name}_advance(${name}_state *s, ${lines}double dt, int64_t max_steps)
{
    if (!(dt >= 0.0) || (dt > 0.0 && s->t + dt == s->t))
        return ${name}_BAD_ARGUMENT;
    return ${name}_advance_to(s, ${names}s->t + dt, max_steps);
}

int ${name}_advance_to(${name}_state *s, ${lines}double t, int64_t max_steps)
{
    ${name}_engine *block = &s->engine;
    int64_t code, switches;
    if (${unless_numbers}!(t >= s->t && t <= LATEST) || max_steps < 1)
        return ${name}_BAD_ARGUMENT;
    s->before = s->engine;
    $end = t;
    $most = max_steps;
$given
    $resumed = 0;
    code = step(block);
    switches = $switches;
    while (code == FULL_LOG) { /* empty it, and go on */
        $switches = 0;
        $resumed = 1;
        code = step(block);
        switches += $switches;
    }
    if (code != ${name}_OK) {
        s->engine = s->before;
        return (int)code;
    }
    s->switches += switches;
    s->logged = $switches;
    show(s);
    return ${name}_OK;
}

/* Return where a parameter is; NULL if there is none. */
static const double *place_of(const ${name}_engine *block, int parameter)
{
$found
    return NULL;
}

double ${name}_get(const ${name}_state *s, int parameter)
{
    const double *place = place_of(&s->engine, parameter);
    return place ? *place : NAN;
}

int ${name}_set(${name}_state *s, int parameter, double value)
{
    ${name}_engine *block = &s->engine;
    if (!place_of(block, parameter) || !is_number(value))
        return ${name}_BAD_ARGUMENT;
$set
    $time_scale = adapt(block);
    show(s);
    return ${name}_OK;
}

void ${name}_switch(const ${name}_state *s, int64_t k, double *t, int64_t *element, int64_t *edge)
{
    const ${name}_engine *block = &s->engine;
    const bool logged = k >= 0 && k < s->logged;
    *t = logged ? $log_t : NAN;
    *element = logged ? $log_element : -1;
    *edge = logged ? $log_edge : -1;
}

const char *${name}_edge(int64_t edge)
{
    switch (edge) {
$edge_names
    default: return "";
    }
}

const char *${name}_message(int code)
{
    switch (code) {
    case ${name}_OK: return "no error";
    case ${name}_BAD_ARGUMENT: return "an argument is not finite or no limit, or time goes backward";
$messages
    default: return "unknown error";
    }
}
