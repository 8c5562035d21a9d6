/* What an FMU of any version does: one instance, its values, its steps and its events.
 *
 * model.h describes the friction. Nothing here is global: all that changes is in an instance, and
 * what a saved state must contain is in its `changing`.
 */
#ifndef FMU_CORE_H
#define FMU_CORE_H

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

/* What FMI calls the modes of an FMU. */
enum mode { INSTANTIATED, INITIALIZING, EVENTS, CONTINUOUS, STEPPING, INTERMEDIATE, TERMINATED, FAILED };

typedef union { double f; int64_t i; } word;

typedef struct {
    bool exchange;              /* Model Exchange; otherwise Co-Simulation */
    enum mode mode;
    double t;
    double start;               /* as announced before the initialization */
    double input[INPUTS + 1];   /* at the start of the next step */
    double end[INPUTS + 1];     /* at its end, if it is given */
    double rate[INPUTS + 1];    /* its derivative, if that is given */
    bool ends[INPUTS + 1];
    bool looked, sloped, marked; /* whether these values are up to date */
    word block[WORDS];
} changing;

typedef struct instance {
    changing now;
    char message[256];
    void *environment;
    void (*tell)(const struct instance *, const char *); /* an error, to the importer */
    void (*logger)(void);       /* the importer's, as a pointer to some function */
    void (*update)(void);       /* the importer's callback during a step, likewise */
    char *name;
} instance;

static bool failed(instance *it, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(it->message, sizeof it->message, format, arguments);
    va_end(arguments);
    it->tell(it, it->message);
    return false;
}

static char *address(instance *it) { return (char *)it->now.block; }

static void reset(instance *it)
{
    bool exchange = it->now.exchange;
    memset(&it->now, 0, sizeof it->now);
    it->now.exchange = exchange;
    it->now.mode = INSTANTIATED;
    MODEL(start)(address(it));
    it->now.block[FOREIGN].i = exchange;
    it->now.t = it->now.start = it->now.block[CLOCK].f;
}

static void outdated(instance *it) { it->now.looked = it->now.sloped = it->now.marked = false; }

static void go_to(instance *it, double t)
{
    it->now.t = it->now.block[CLOCK].f = t;
    outdated(it);
}

static bool begin(instance *it, double t)
{
    if (it->now.mode != INSTANTIATED)
        return failed(it, "initialization may begin only once; reset the instance before");
    if (!(fabs(t) <= 1e9))
        return failed(it, "the start time is %.17g s; it must be within 1e9 s", t);
    for (int k = 0; k < INPUTS; k++)
        it->now.input[k] = it->now.block[TABLES + 4 * k + 2].f;
    if (t != it->now.t) {
        go_to(it, t);
        MODEL(restart)(address(it));
    }
    it->now.mode = INITIALIZING;
    return true;
}

/* ---------------------------------------------------------------- values */
static bool look(instance *it)
{
    if (!it->now.looked)
        MODEL(observe)(address(it));
    return it->now.looked = true;
}

static bool get_number(instance *it, uint32_t reference, double *value)
{
    if (reference >= VARIABLES)
        return failed(it, "there is no variable with the reference %u", (unsigned)reference);
    const variable *v = &variables[reference];
    const word *block = it->now.block;
    switch (v->place) {
    case IN_BLOCK:
        *value = block[v->index].f;
        return true;
    case INPUT:
        *value = it->now.mode == INSTANTIATED ? block[TABLES + 4 * v->index + 2].f
                                              : it->now.input[v->index];
        return true;
    case SEEN:
        look(it);
        *value = block[OBSERVED + v->index].f;
        return true;
    case SLOPES:
        if (!it->now.sloped)
            MODEL(slope)(address(it));
        it->now.sloped = true;
        *value = block[SLOPE + v->index].f;
        return true;
    case INDICATOR:
        if (!it->now.marked)
            MODEL(indicate)(address(it));
        it->now.marked = true;
        *value = block[INDICATORS_AT + v->index].f;
        return true;
    case TIME:
        *value = it->now.t;
        return true;
    default:
        return failed(it, "the variable with the reference %u is an integer", (unsigned)reference);
    }
}

static bool set_number(instance *it, uint32_t reference, double value)
{
    if (reference >= VARIABLES)
        return failed(it, "there is no variable with the reference %u", (unsigned)reference);
    const variable *v = &variables[reference];
    enum mode mode = it->now.mode;
    if (!isfinite(value))
        return failed(it, "the variable with the reference %u cannot be %g", (unsigned)reference, value);
    if (v->place == INPUT) {
        if (mode == INTERMEDIATE) { /* the end of the step that begins now */
            it->now.end[v->index] = value;
            it->now.ends[v->index] = true;
            return true;
        }
        it->now.input[v->index] = value;
        it->now.rate[v->index] = 0.0;
        if (mode == INSTANTIATED || mode == INITIALIZING || it->now.exchange) {
            it->now.block[TABLES + 4 * v->index + 2].f = value;
            it->now.block[TABLES + 4 * v->index + 3].f = value;
            outdated(it);
        }
        return true;
    }
    if (v->place != IN_BLOCK || !v->settable)
        return failed(it, "the variable with the reference %u cannot be set", (unsigned)reference);
    if (mode != INSTANTIATED && mode != INITIALIZING)
        return failed(it, "the variable with the reference %u can be set only before the start",
                      (unsigned)reference);
    it->now.block[v->index].f = value;
    if (v->index >= Y && v->index < Y + LENGTH) /* an initial value: it stays */
        it->now.block[GIVEN + v->index - Y].i = 1;
    MODEL(derive)(address(it));
    outdated(it);
    return true;
}

static bool get_count(instance *it, uint32_t reference, int64_t *value)
{
    if (reference < VARIABLES && variables[reference].place == STATE) /* counted from 1 */
        *value = it->now.block[variables[reference].index].i + 1;
    else if (reference < VARIABLES && variables[reference].place == COUNT)
        *value = it->now.block[variables[reference].index].i;
    else
        return failed(it, "there is no integer with the reference %u", (unsigned)reference);
    return true;
}

static bool set_count(instance *it, uint32_t reference, int64_t value)
{
    if (reference >= VARIABLES || variables[reference].place != STATE)
        return failed(it, "there is no integer with the reference %u that can be set",
                      (unsigned)reference);
    const variable *v = &variables[reference];
    if (it->now.mode != INSTANTIATED && it->now.mode != INITIALIZING)
        return failed(it, "states can be set only before the start");
    if (value < 1 || value > v->settable)
        return failed(it, "an element has %d states, there is no number %ld", v->settable, (long)value);
    it->now.block[v->index].i = value - 1;
    MODEL(derive)(address(it));
    outdated(it);
    return true;
}

/* ---------------------------------------------------------------- running */
static bool enter(instance *it, enum mode mode, bool exchange)
{
    enum mode from = it->now.mode;
    if (it->now.exchange != exchange)
        return failed(it, "this is not a function of %s", exchange ? "Co-Simulation" : "Model Exchange");
    if (from != EVENTS && from != CONTINUOUS && from != STEPPING)
        return failed(it, "not before the initialization has ended, nor after an error");
    it->now.mode = mode;
    return true;
}

static bool set_time(instance *it, double t)
{
    if (!it->now.exchange || !isfinite(t))
        return failed(it, "the time cannot be set to %g s here", t);
    go_to(it, t);
    return true;
}

static bool stopped(instance *it, int64_t code)
{
    it->now.mode = FAILED;
    return failed(it, "t = %.17g s: %s", it->now.block[CLOCK].f, reason(code));
}

/* Model Exchange: all edges that are enabled here. */
static bool settled(instance *it, const char *name)
{
    if (it->now.mode != EVENTS)
        return failed(it, "%s is for the event mode", name);
    int64_t code = MODEL(settle)(address(it));
    outdated(it);
    return code == 0 || stopped(it, code);
}

/* Co-Simulation: a step on straight lines, with located switches inside. */
static bool step(instance *it, double t, double h)
{
    word *block = it->now.block;
    double tick = 1e-9 * (fabs(t) + h);
    if (!(h > 0.0) || !isfinite(t + h))
        return failed(it, "a step of %.17g s; it must be positive", h);
    if (!(fabs(t - it->now.t) <= tick))
        return failed(it, "a step from %.17g s, but the time is %.17g s", t, it->now.t);
    block[SAMPLE_END].f = t + h;
    for (int k = 0; k < INPUTS; k++) {
        double end = it->now.ends[k] ? it->now.end[k] : it->now.input[k] + it->now.rate[k] * h;
        block[SAMPLE_INPUTS + 2 * k].f = it->now.input[k];
        block[SAMPLE_INPUTS + 2 * k + 1].f = end;
        it->now.input[k] = end;
        it->now.rate[k] = 0.0;
        it->now.ends[k] = false;
    }
    block[SAMPLE_RESUMED].i = 0;
    for (;;) {
        int64_t code = MODEL(step)(address(it));
        block[SWITCHED].i += block[SAMPLE_SWITCHES].i;
        if (code == 0)
            break;
        if (code != FULL_LOG) /* the log of switches is full: it is read, and the step goes on */
            return stopped(it, code);
        block[SAMPLE_SWITCHES].i = 0;
        block[SAMPLE_RESUMED].i = 1;
    }
    it->now.t = t + h;
    outdated(it);
    return true;
}

static bool set_states(instance *it, const double *x, size_t count)
{
    if (!it->now.exchange)
        return failed(it, "in Co-Simulation the FMU integrates its states");
    if (count != STATES)
        return failed(it, "there are %d continuous states, not %d", STATES, (int)count);
    for (int k = 0; k < STATES; k++)
        it->now.block[state_places[k]].f = x[k];
    outdated(it);
    return true;
}

static bool get_states(instance *it, double *x, size_t count)
{
    if (count != STATES)
        return failed(it, "there are %d continuous states, not %d", STATES, (int)count);
    for (int k = 0; k < STATES; k++)
        x[k] = it->now.block[state_places[k]].f;
    return true;
}

static bool get_slopes(instance *it, double *dx, size_t count)
{
    if (count != STATES)
        return failed(it, "there are %d continuous states, not %d", STATES, (int)count);
    MODEL(slope)(address(it));
    for (int k = 0; k < STATES; k++)
        dx[k] = it->now.block[SLOPE + state_places[k] - Y].f;
    return true;
}

static bool get_nominals(instance *it, double *x, size_t count)
{
    if (count != STATES)
        return failed(it, "there are %d continuous states, not %d", STATES, (int)count);
    for (int k = 0; k < STATES; k++)
        x[k] = state_nominals[k];
    return true;
}

static bool get_indicators(instance *it, double *z, size_t count)
{
    if (count != INDICATORS)
        return failed(it, "there are %d event indicators, not %d", INDICATORS, (int)count);
    MODEL(indicate)(address(it));
    for (int k = 0; k < INDICATORS; k++)
        z[k] = it->now.block[INDICATORS_AT + k].f;
    return true;
}

/* ---------------------------------------------------------------- saved states */
static bool save(instance *it, void **saved)
{
    if (*saved == NULL)
        *saved = malloc(sizeof(changing));
    if (*saved == NULL)
        return failed(it, "there is no memory for the state");
    memcpy(*saved, &it->now, sizeof(changing));
    return true;
}

static bool serialize(instance *it, const void *saved, void *bytes, size_t size)
{
    if (saved == NULL || size < sizeof(changing))
        return failed(it, "a state has %lu bytes, not %lu", (unsigned long)sizeof(changing),
                      (unsigned long)size);
    memcpy(bytes, saved, sizeof(changing));
    return true;
}

static bool deserialize(instance *it, const void *bytes, size_t size, void **saved)
{
    if (size != sizeof(changing))
        return failed(it, "a state has %lu bytes, not %lu", (unsigned long)sizeof(changing),
                      (unsigned long)size);
    if (*saved == NULL)
        *saved = malloc(sizeof(changing));
    if (*saved == NULL)
        return failed(it, "there is no memory for the state");
    memcpy(*saved, bytes, sizeof(changing));
    return true;
}

static bool restore(instance *it, const void *saved)
{
    const changing *other = saved;
    if (saved == NULL || other->exchange != it->now.exchange)
        return failed(it, "this is no state of such an instance");
    memcpy(&it->now, saved, sizeof(changing));
    return true;
}

#endif
