/* The functions of FMI 3.0. The types are those that the standard prescribes. */
#include "fmu_core.h"

#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define JOINED(a, b) a##b
#define JOIN(a, b) JOINED(a, b)
#define FMI3(name) JOIN(FMI3_FUNCTION_PREFIX, name) /* several FMUs in one program */
#else
#define FMI3(name) name
#endif
#if defined(_WIN32) || defined(__CYGWIN__)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef char fmi3Char;
typedef const fmi3Char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category,
                                       fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 t,
                                               fmi3Boolean setRequested, fmi3Boolean getAllowed,
                                               fmi3Boolean stepFinished, fmi3Boolean canReturnEarly,
                                               fmi3Boolean *earlyReturnRequested,
                                               fmi3Float64 *earlyReturnTime);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

#define C fmi3Instance c
#define REFERENCES const fmi3ValueReference vr[], size_t n
#define UNUSED(x) (void)(x)

static fmi3Status status(bool fine) { return fine ? fmi3OK : fmi3Error; }

static void tell(const instance *it, const char *message)
{
    if (it->logger != NULL)
        ((fmi3LogMessageCallback)it->logger)(it->environment, fmi3Error, "logStatusError", message);
}

static fmi3Status unsupported(fmi3Instance c, const char *name)
{
    return status(failed(c, "%s is not supported", name));
}

EXPORT const char *FMI3(fmi3GetVersion)(void) { return "3.0"; }

EXPORT fmi3Status FMI3(fmi3SetDebugLogging)(C, fmi3Boolean on, size_t n, const fmi3String kinds[])
{
    UNUSED(c);
    UNUSED(on);
    UNUSED(n);
    UNUSED(kinds);
    return fmi3OK; /* only errors are logged, always */
}

/* ---------------------------------------------------------------- instances */
static fmi3Instance made(fmi3String token, fmi3InstanceEnvironment environment,
                         fmi3LogMessageCallback log, bool exchange)
{
    instance *it = calloc(1, sizeof *it);
    if (it == NULL)
        return NULL;
    it->tell = tell;
    it->logger = (void (*)(void))log;
    it->environment = environment;
    bool fine = true;
    if (token == NULL || strcmp(token, TOKEN) != 0)
        fine = failed(it, "the instantiation token is not that of these sources");
    if (fine && exchange && !HAS_EXCHANGE)
        fine = failed(it, "there is no Model Exchange in this FMU; its documentation says why");
    if (!fine) {
        free(it);
        return NULL;
    }
    it->now.exchange = exchange;
    reset(it);
    return it;
}

EXPORT fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token,
                                                       fmi3String resources, fmi3Boolean visible,
                                                       fmi3Boolean logging,
                                                       fmi3InstanceEnvironment environment,
                                                       fmi3LogMessageCallback log)
{
    UNUSED(name);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    return made(token, environment, log, true);
}

EXPORT fmi3Instance FMI3(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean eventMode, fmi3Boolean early,
    const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    UNUSED(name);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    UNUSED(eventMode);
    UNUSED(early);
    UNUSED(required);
    UNUSED(n);
    instance *it = made(token, environment, log, false);
    if (it != NULL)
        it->update = (void (*)(void))update;
    return it;
}

EXPORT fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    UNUSED(name);
    UNUSED(token);
    UNUSED(resources);
    UNUSED(visible);
    UNUSED(logging);
    UNUSED(clock);
    UNUSED(lock);
    UNUSED(unlock);
    if (log != NULL)
        log(environment, fmi3Error, "logStatusError", "there is no Scheduled Execution in this FMU");
    return NULL;
}

EXPORT void FMI3(fmi3FreeInstance)(C) { free(c); }

EXPORT fmi3Status FMI3(fmi3EnterInitializationMode)(C, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                                    fmi3Float64 start, fmi3Boolean ends,
                                                    fmi3Float64 stop)
{
    UNUSED(tolerant);
    UNUSED(tolerance);
    UNUSED(ends);
    UNUSED(stop);
    return status(begin(c, start));
}

EXPORT fmi3Status FMI3(fmi3ExitInitializationMode)(C)
{
    instance *it = c;
    if (it->now.mode != INITIALIZING)
        return status(failed(it, "the initialization has not begun"));
    it->now.mode = it->now.exchange ? EVENTS : STEPPING;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3Terminate)(C)
{
    ((instance *)c)->now.mode = TERMINATED;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3Reset)(C)
{
    reset(c);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3EnterConfigurationMode)(C)
{
    return unsupported(c, "fmi3EnterConfigurationMode");
}

EXPORT fmi3Status FMI3(fmi3ExitConfigurationMode)(C)
{
    return unsupported(c, "fmi3ExitConfigurationMode");
}

/* ---------------------------------------------------------------- values */
EXPORT fmi3Status FMI3(fmi3GetFloat64)(C, REFERENCES, fmi3Float64 values[], size_t count)
{
    if (count != n)
        return status(failed(c, "every variable has one value"));
    for (size_t k = 0; k < n; k++)
        if (!get_number(c, vr[k], &values[k]))
            return fmi3Error;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SetFloat64)(C, REFERENCES, const fmi3Float64 values[], size_t count)
{
    if (count != n)
        return status(failed(c, "every variable has one value"));
    for (size_t k = 0; k < n; k++)
        if (!set_number(c, vr[k], values[k]))
            return fmi3Error;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3GetInt64)(C, REFERENCES, fmi3Int64 values[], size_t count)
{
    if (count != n)
        return status(failed(c, "every variable has one value"));
    for (size_t k = 0; k < n; k++)
        if (!get_count(c, vr[k], &values[k]))
            return fmi3Error;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SetInt64)(C, REFERENCES, const fmi3Int64 values[], size_t count)
{
    if (count != n)
        return status(failed(c, "every variable has one value"));
    for (size_t k = 0; k < n; k++)
        if (!set_count(c, vr[k], values[k]))
            return fmi3Error;
    return fmi3OK;
}

/* Types that no variable has. */
#define ABSENT(kind)                                                                               \
    EXPORT fmi3Status FMI3(fmi3Get##kind)(C, REFERENCES, fmi3##kind values[], size_t count)        \
    {                                                                                              \
        UNUSED(vr);                                                                                \
        UNUSED(values);                                                                            \
        UNUSED(count);                                                                             \
        return n == 0 ? fmi3OK : unsupported(c, "fmi3Get" #kind);                                  \
    }                                                                                              \
    EXPORT fmi3Status FMI3(fmi3Set##kind)(C, REFERENCES, const fmi3##kind values[], size_t count)  \
    {                                                                                              \
        UNUSED(vr);                                                                                \
        UNUSED(values);                                                                            \
        UNUSED(count);                                                                             \
        return n == 0 ? fmi3OK : unsupported(c, "fmi3Set" #kind);                                  \
    }
ABSENT(Float32)
ABSENT(Int8)
ABSENT(UInt8)
ABSENT(Int16)
ABSENT(UInt16)
ABSENT(Int32)
ABSENT(UInt32)
ABSENT(UInt64)
ABSENT(Boolean)
ABSENT(String)

EXPORT fmi3Status FMI3(fmi3GetBinary)(C, REFERENCES, size_t sizes[], fmi3Binary values[], size_t count)
{
    UNUSED(vr);
    UNUSED(sizes);
    UNUSED(values);
    UNUSED(count);
    return n == 0 ? fmi3OK : unsupported(c, "fmi3GetBinary");
}

EXPORT fmi3Status FMI3(fmi3SetBinary)(C, REFERENCES, const size_t sizes[], const fmi3Binary values[],
                                      size_t count)
{
    UNUSED(vr);
    UNUSED(sizes);
    UNUSED(values);
    UNUSED(count);
    return n == 0 ? fmi3OK : unsupported(c, "fmi3SetBinary");
}

EXPORT fmi3Status FMI3(fmi3GetClock)(C, REFERENCES, fmi3Clock values[])
{
    UNUSED(vr);
    UNUSED(values);
    return n == 0 ? fmi3OK : unsupported(c, "fmi3GetClock");
}

EXPORT fmi3Status FMI3(fmi3SetClock)(C, REFERENCES, const fmi3Clock values[])
{
    UNUSED(vr);
    UNUSED(values);
    return n == 0 ? fmi3OK : unsupported(c, "fmi3SetClock");
}

EXPORT fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(C, fmi3ValueReference vr, size_t *n)
{
    UNUSED(vr);
    UNUSED(n);
    return unsupported(c, "fmi3GetNumberOfVariableDependencies");
}

EXPORT fmi3Status FMI3(fmi3GetVariableDependencies)(C, fmi3ValueReference vr, size_t elements[],
                                                    fmi3ValueReference others[], size_t places[],
                                                    fmi3DependencyKind kinds[], size_t n)
{
    UNUSED(vr);
    UNUSED(elements);
    UNUSED(others);
    UNUSED(places);
    UNUSED(kinds);
    UNUSED(n);
    return unsupported(c, "fmi3GetVariableDependencies");
}

#define ABSENT_DERIVATIVE(name)                                                                    \
    EXPORT fmi3Status FMI3(name)(C, const fmi3ValueReference a[], size_t na,                       \
                                 const fmi3ValueReference b[], size_t nb, const fmi3Float64 seed[], \
                                 size_t ns, fmi3Float64 found[], size_t nf)                        \
    {                                                                                              \
        UNUSED(a);                                                                                 \
        UNUSED(na);                                                                                \
        UNUSED(b);                                                                                 \
        UNUSED(nb);                                                                                \
        UNUSED(seed);                                                                              \
        UNUSED(ns);                                                                                \
        UNUSED(found);                                                                             \
        UNUSED(nf);                                                                                \
        return unsupported(c, #name);                                                              \
    }
ABSENT_DERIVATIVE(fmi3GetDirectionalDerivative)
ABSENT_DERIVATIVE(fmi3GetAdjointDerivative)

/* ---------------------------------------------------------------- saved states */
EXPORT fmi3Status FMI3(fmi3GetFMUState)(C, fmi3FMUState *saved) { return status(save(c, saved)); }
EXPORT fmi3Status FMI3(fmi3SetFMUState)(C, fmi3FMUState saved) { return status(restore(c, saved)); }

EXPORT fmi3Status FMI3(fmi3FreeFMUState)(C, fmi3FMUState *saved)
{
    UNUSED(c);
    if (saved != NULL) {
        free(*saved);
        *saved = NULL;
    }
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SerializedFMUStateSize)(C, fmi3FMUState saved, size_t *size)
{
    UNUSED(c);
    UNUSED(saved);
    *size = sizeof(changing);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SerializeFMUState)(C, fmi3FMUState saved, fmi3Byte bytes[], size_t size)
{
    return status(serialize(c, saved, bytes, size));
}

EXPORT fmi3Status FMI3(fmi3DeserializeFMUState)(C, const fmi3Byte bytes[], size_t size,
                                                fmi3FMUState *saved)
{
    return status(deserialize(c, bytes, size, saved));
}

/* ---------------------------------------------------------------- clocks: there are none */
EXPORT fmi3Status FMI3(fmi3GetIntervalDecimal)(C, REFERENCES, fmi3Float64 intervals[],
                                               fmi3IntervalQualifier qualifiers[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(intervals);
    UNUSED(qualifiers);
    return unsupported(c, "fmi3GetIntervalDecimal");
}

EXPORT fmi3Status FMI3(fmi3GetIntervalFraction)(C, REFERENCES, fmi3UInt64 counters[],
                                                fmi3UInt64 resolutions[],
                                                fmi3IntervalQualifier qualifiers[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(counters);
    UNUSED(resolutions);
    UNUSED(qualifiers);
    return unsupported(c, "fmi3GetIntervalFraction");
}

EXPORT fmi3Status FMI3(fmi3GetShiftDecimal)(C, REFERENCES, fmi3Float64 shifts[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(shifts);
    return unsupported(c, "fmi3GetShiftDecimal");
}

EXPORT fmi3Status FMI3(fmi3GetShiftFraction)(C, REFERENCES, fmi3UInt64 counters[],
                                             fmi3UInt64 resolutions[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(counters);
    UNUSED(resolutions);
    return unsupported(c, "fmi3GetShiftFraction");
}

EXPORT fmi3Status FMI3(fmi3SetIntervalDecimal)(C, REFERENCES, const fmi3Float64 intervals[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(intervals);
    return unsupported(c, "fmi3SetIntervalDecimal");
}

EXPORT fmi3Status FMI3(fmi3SetIntervalFraction)(C, REFERENCES, const fmi3UInt64 counters[],
                                                const fmi3UInt64 resolutions[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(counters);
    UNUSED(resolutions);
    return unsupported(c, "fmi3SetIntervalFraction");
}

EXPORT fmi3Status FMI3(fmi3SetShiftDecimal)(C, REFERENCES, const fmi3Float64 shifts[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(shifts);
    return unsupported(c, "fmi3SetShiftDecimal");
}

EXPORT fmi3Status FMI3(fmi3SetShiftFraction)(C, REFERENCES, const fmi3UInt64 counters[],
                                             const fmi3UInt64 resolutions[])
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(counters);
    UNUSED(resolutions);
    return unsupported(c, "fmi3SetShiftFraction");
}

EXPORT fmi3Status FMI3(fmi3ActivateModelPartition)(C, fmi3ValueReference clock, fmi3Float64 t)
{
    UNUSED(clock);
    UNUSED(t);
    return unsupported(c, "fmi3ActivateModelPartition");
}

/* ---------------------------------------------------------------- Model Exchange */
EXPORT fmi3Status FMI3(fmi3EnterEventMode)(C) { return status(enter(c, EVENTS, true)); }

EXPORT fmi3Status FMI3(fmi3EvaluateDiscreteStates)(C)
{
    UNUSED(c);
    return fmi3OK; /* all of it happens in fmi3UpdateDiscreteStates */
}

EXPORT fmi3Status FMI3(fmi3UpdateDiscreteStates)(C, fmi3Boolean *again, fmi3Boolean *terminate,
                                                 fmi3Boolean *nominals, fmi3Boolean *moved,
                                                 fmi3Boolean *defined, fmi3Float64 *next)
{
    instance *it = c;
    if (it->now.mode != EVENTS)
        return status(failed(it, "fmi3UpdateDiscreteStates is for the event mode"));
    if (!settle_here(it))
        return fmi3Error;
    *again = *terminate = *nominals = false;
    *moved = it->now.block[MOVED].i != 0;
    *next = it->now.block[NEXT].f;
    *defined = isfinite(*next);
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3EnterContinuousTimeMode)(C)
{
    return status(enter(c, CONTINUOUS, true));
}

EXPORT fmi3Status FMI3(fmi3CompletedIntegratorStep)(C, fmi3Boolean final, fmi3Boolean *event,
                                                    fmi3Boolean *terminate)
{
    UNUSED(final);
    *event = MODEL(changed)(address(c)) != 0;
    *terminate = false;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3SetTime)(C, fmi3Float64 t)
{
    return status(set_time(c, t));
}

EXPORT fmi3Status FMI3(fmi3SetContinuousStates)(C, const fmi3Float64 x[], size_t n)
{
    return status(set_states(c, x, n));
}

EXPORT fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(C, fmi3Float64 dx[], size_t n)
{
    return status(get_slopes(c, dx, n));
}

EXPORT fmi3Status FMI3(fmi3GetEventIndicators)(C, fmi3Float64 z[], size_t n)
{
    return status(get_indicators(c, z, n));
}

EXPORT fmi3Status FMI3(fmi3GetContinuousStates)(C, fmi3Float64 x[], size_t n)
{
    return status(get_states(c, x, n));
}

EXPORT fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(C, fmi3Float64 x[], size_t n)
{
    return status(get_nominals(c, x, n));
}

EXPORT fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(C, size_t *n)
{
    UNUSED(c);
    *n = INDICATORS;
    return fmi3OK;
}

EXPORT fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(C, size_t *n)
{
    UNUSED(c);
    *n = STATES;
    return fmi3OK;
}

/* ---------------------------------------------------------------- Co-Simulation */
EXPORT fmi3Status FMI3(fmi3EnterStepMode)(C) { return status(enter(c, STEPPING, false)); }

EXPORT fmi3Status FMI3(fmi3GetOutputDerivatives)(C, REFERENCES, const fmi3Int32 orders[],
                                                 fmi3Float64 values[], size_t count)
{
    UNUSED(vr);
    UNUSED(n);
    UNUSED(orders);
    UNUSED(values);
    UNUSED(count);
    return unsupported(c, "fmi3GetOutputDerivatives");
}

/* The importer may set the inputs at the end of the step while it is asked here, before the step:
 * then they are straight lines during it. Otherwise they keep their values. */
EXPORT fmi3Status FMI3(fmi3DoStep)(C, fmi3Float64 t, fmi3Float64 h, fmi3Boolean final,
                                   fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                                   fmi3Float64 *last)
{
    UNUSED(final);
    instance *it = c;
    *event = *terminate = *early = false;
    *last = it->now.t;
    if (it->now.mode != STEPPING)
        return status(failed(it, "a step before the initialization has ended, or after an error"));
    if (it->update != NULL && INPUTS > 0) {
        bool requested = false;
        double wanted = t;
        it->now.mode = INTERMEDIATE;
        ((fmi3IntermediateUpdateCallback)it->update)(it->environment, t + h, true, false, false,
                                                     false, &requested, &wanted);
        it->now.mode = STEPPING;
    }
    bool fine = step(it, t, h);
    *last = it->now.t;
    return status(fine);
}
