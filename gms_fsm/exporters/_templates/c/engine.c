/* $title; see ${name}.h. Written by gms-fsm $version. */
#include "${name}.h"

#include <string.h>
$engine
static bool is_number(double u)
{
    return u - u == 0.0;
}

/* Copy what is public. */
static void show(${name}_state *s)
{
    const ${name}_word *w = s->word;
    s->t = w[$clock].f;
$shown
}

void ${name}_init(${name}_state *s)
{
    ${name}_word *w = s->word;
    memset(s, 0, sizeof *s);
$image
    show(s);
}

int ${name}_advance(${name}_state *s, ${lines}double dt)
{
    if (!(dt >= 0.0) || (dt > 0.0 && s->t + dt == s->t))
        return ${name}_BAD_ARGUMENT;
    return ${name}_advance_to(s, ${names}s->t + dt);
}

int ${name}_advance_to(${name}_state *s, ${lines}double t)
{
    ${name}_word *w = s->word;
    int64_t code;
    if (${unless_numbers}!(t >= s->t && t <= $latest))
        return ${name}_BAD_ARGUMENT;
    w[$end].f = t;
$given
    w[$resumed].i = 0;
    code = step((char *)w);
    s->switches += w[$switches].i;
    while (code == $full_log) {
        w[$switches].i = 0;
        w[$resumed].i = 1;
        code = step((char *)w);
        s->switches += w[$switches].i;
    }
    s->logged = w[$switches].i;
    show(s);
    return (int)code;
}

static bool is_parameter(int parameter)
{
    return $spans;
}

double ${name}_get(const ${name}_state *s, int parameter)
{
    return is_parameter(parameter) ? s->word[parameter].f : NAN;
}

int ${name}_set(${name}_state *s, int parameter, double value)
{
    ${name}_word *w = s->word;
    if (!is_parameter(parameter) || !is_number(value))
        return ${name}_BAD_ARGUMENT;
    w[parameter].f = value;
    w[$time_scale].f = adapt((char *)w);
    show(s);
    return ${name}_OK;
}

void ${name}_switch(const ${name}_state *s, int64_t k, double *t, int64_t *element, int64_t *edge)
{
    const ${name}_word *w = s->word;
    *t = w[$log_t + k].f;
    *element = w[$log_element + k].i;
    *edge = w[$log_edge + k].i;
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
    case ${name}_BAD_ARGUMENT: return "an argument is not finite, or time goes backward";
$messages
    default: return "unknown error";
    }
}
