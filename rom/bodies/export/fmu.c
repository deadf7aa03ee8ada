/* A linear system x' = A x + B f, u = C x + D f as a functional mock-up unit after FMI 2.0.3,
   for model exchange and for co-simulation. model.h, which is made with it, holds the numbers.

   Value references: 0 ... inputs, then outputs, then states, then derivatives of the states.
   A co-simulation step is exact for forces that are constant over the step: x -> e^(A h) x + integral e^(A t) dt B f. */

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model.h"

#define OUTPUTS INPUTS_COUNT
#define STATES (OUTPUTS + OUTPUTS_COUNT)
#define SLOPES (STATES + STATES_COUNT)
#define ALL (SLOPES + STATES_COUNT)
#define WIDE (STATES_COUNT + INPUTS_COUNT)
#define TERMS 20
#if defined _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

/* The types and structures that the standard prescribes. */
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

typedef struct {
    double state[STATES_COUNT], force[INPUTS_COUNT];
    double step;                                /* that `move` and `push` belong to */
    double move[STATES_COUNT * STATES_COUNT];   /* e^(A step) */
    double push[STATES_COUNT * INPUTS_COUNT];
} Unit;

static double value(const Unit *unit, unsigned reference) {
    double sum = 0;
    if (reference < OUTPUTS) return unit->force[reference];
    if (reference < STATES) {
        unsigned row = reference - OUTPUTS;
        for (int j = 0; j < STATES_COUNT; j++) sum += C[row * STATES_COUNT + j] * unit->state[j];
        for (int j = 0; j < INPUTS_COUNT; j++) sum += D[row * INPUTS_COUNT + j] * unit->force[j];
        return sum;
    }
    if (reference < SLOPES) return unit->state[reference - STATES];
    unsigned row = reference - SLOPES;
    for (int j = 0; j < STATES_COUNT; j++) sum += A[row * STATES_COUNT + j] * unit->state[j];
    for (int j = 0; j < INPUTS_COUNT; j++) sum += B[row * INPUTS_COUNT + j] * unit->force[j];
    return sum;
}

/* Derivative of an output or slope by an input or state: one of the numbers of the system. */
static double slope(unsigned of, unsigned by) {
    if (of >= OUTPUTS && of < STATES) {
        if (by < OUTPUTS) return D[(of - OUTPUTS) * INPUTS_COUNT + by];
        if (by >= STATES && by < SLOPES) return C[(of - OUTPUTS) * STATES_COUNT + by - STATES];
    }
    if (of >= SLOPES) {
        if (by < OUTPUTS) return B[(of - SLOPES) * INPUTS_COUNT + by];
        if (by >= STATES && by < SLOPES) return A[(of - SLOPES) * STATES_COUNT + by - STATES];
    }
    return of == by;
}

static void product(const double *left, const double *right, double *result) {
    memset(result, 0, sizeof(double) * WIDE * WIDE);
    for (int i = 0; i < WIDE; i++)
        for (int k = 0; k < WIDE; k++) {
            double factor = left[i * WIDE + k];
            if (factor != 0)
                for (int j = 0; j < WIDE; j++) result[i * WIDE + j] += factor * right[k * WIDE + j];
        }
}

/* Exponential of [A B; 0 0] step by scaling, Taylor's series and squaring. */
static int prepare(Unit *unit, double step) {
    size_t size = (size_t)WIDE * WIDE;
    double *block = malloc(4 * size * sizeof(double));
    if (!block) return 0;
    double *scaled = block, *sum = block + size, *term = block + 2 * size, *spare = block + 3 * size, largest = 0;
    memset(scaled, 0, size * sizeof(double));
    for (int i = 0; i < STATES_COUNT; i++) {
        double row = 0;
        for (int j = 0; j < STATES_COUNT; j++) row += fabs(scaled[i * WIDE + j] = A[i * STATES_COUNT + j] * step);
        for (int j = 0; j < INPUTS_COUNT; j++) scaled[i * WIDE + STATES_COUNT + j] = B[i * INPUTS_COUNT + j] * step;
        if (row > largest) largest = row;
    }
    int halvings = 0;
    while (largest > 0.5) { largest /= 2; halvings++; }
    for (size_t i = 0; i < size; i++) { scaled[i] = ldexp(scaled[i], -halvings); sum[i] = i % (WIDE + 1) == 0; }
    memcpy(term, sum, size * sizeof(double));
    for (int k = 1; k <= TERMS; k++) {
        product(term, scaled, spare);
        for (size_t i = 0; i < size; i++) sum[i] += term[i] = spare[i] / k;
    }
    for (int k = 0; k < halvings; k++) { product(sum, sum, spare); memcpy(sum, spare, size * sizeof(double)); }
    for (int i = 0; i < STATES_COUNT; i++) {
        memcpy(unit->move + (size_t)i * STATES_COUNT, sum + (size_t)i * WIDE, STATES_COUNT * sizeof(double));
        memcpy(unit->push + (size_t)i * INPUTS_COUNT, sum + (size_t)i * WIDE + STATES_COUNT, INPUTS_COUNT * sizeof(double));
    }
    unit->step = step;
    free(block);
    return 1;
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }
API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)c; (void)on; (void)n; (void)names;
    return fmi2OK;
}
API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                  const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name; (void)type; (void)resources; (void)functions; (void)visible; (void)logging;
    return strcmp(guid, GUID) ? NULL : calloc(1, sizeof(Unit));
}
API void fmi2FreeInstance(fmi2Component c) { free(c); }
API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has, fmi2Real tolerance, fmi2Real start,
                                   fmi2Boolean ends, fmi2Real stop) {
    (void)c; (void)has; (void)tolerance; (void)start; (void)ends; (void)stop;
    return fmi2OK;
}
API fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
API fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
API fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
API fmi2Status fmi2Reset(fmi2Component c) { memset(c, 0, sizeof(Unit)); return fmi2OK; }

API fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= ALL) return fmi2Error;
        values[i] = value(c, vr[i]);
    }
    return fmi2OK;
}
API fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    Unit *unit = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] < OUTPUTS) unit->force[vr[i]] = values[i];
        else if (vr[i] >= STATES && vr[i] < SLOPES) unit->state[vr[i] - STATES] = values[i];
        else return fmi2Error;
    }
    return fmi2OK;
}
/* There are no variables of other types. */
#define NONE(name, type) \
    API fmi2Status name(fmi2Component c, const fmi2ValueReference vr[], size_t n, type values[]) { \
        (void)c; (void)vr; (void)values; \
        return n ? fmi2Error : fmi2OK; \
    }
NONE(fmi2GetInteger, fmi2Integer)
NONE(fmi2GetBoolean, fmi2Boolean)
NONE(fmi2GetString, fmi2String)
NONE(fmi2SetInteger, const fmi2Integer)
NONE(fmi2SetBoolean, const fmi2Boolean)
NONE(fmi2SetString, const fmi2String)

API fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state && !(*state = malloc(sizeof(Unit)))) return fmi2Error;
    memcpy(*state, c, sizeof(Unit));
    return fmi2OK;
}
API fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { memcpy(c, state, sizeof(Unit)); return fmi2OK; }
API fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
API fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)c; (void)state;
    *size = sizeof(Unit);
    return fmi2OK;
}
API fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    (void)c;
    if (size < sizeof(Unit)) return fmi2Error;
    memcpy(bytes, state, sizeof(Unit));
    return fmi2OK;
}
API fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    (void)c;
    if (size != sizeof(Unit) || (!*state && !(*state = malloc(sizeof(Unit))))) return fmi2Error;
    memcpy(*state, bytes, sizeof(Unit));
    return fmi2OK;
}
API fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                            const fmi2ValueReference known[], size_t m, const fmi2Real direction[],
                                            fmi2Real result[]) {
    (void)c;
    for (size_t i = 0; i < n; i++) {
        result[i] = 0;
        for (size_t j = 0; j < m; j++) result[i] += slope(unknown[i], known[j]) * direction[j];
    }
    return fmi2OK;
}

/* Model exchange */
API fmi2Status fmi2EnterEventMode(fmi2Component c) { (void)c; return fmi2OK; }
API fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    (void)c;
    memset(info, 0, sizeof *info);
    return fmi2OK;
}
API fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { (void)c; return fmi2OK; }
API fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean keep, fmi2Boolean *event, fmi2Boolean *end) {
    (void)c; (void)keep;
    *event = *end = 0;
    return fmi2OK;
}
API fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { (void)c; (void)time; return fmi2OK; }
API fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    memcpy(((Unit *)c)->state, x, n * sizeof(double));
    return fmi2OK;
}
API fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    memcpy(x, ((Unit *)c)->state, n * sizeof(double));
    return fmi2OK;
}
API fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = value(c, (unsigned)(SLOPES + i));
    return fmi2OK;
}
API fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = NOMINAL;
    return fmi2OK;
}
API fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real x[], size_t n) {
    (void)c; (void)x; (void)n;
    return fmi2OK;
}

/* Co-simulation */
API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean final) {
    Unit *unit = c;
    double next[STATES_COUNT];
    (void)time; (void)final;
    if (!(step >= 0) || (unit->step != step && !prepare(unit, step))) return fmi2Error;
    for (int i = 0; i < STATES_COUNT; i++) {
        next[i] = 0;
        for (int j = 0; j < STATES_COUNT; j++) next[i] += unit->move[(size_t)i * STATES_COUNT + j] * unit->state[j];
        for (int j = 0; j < INPUTS_COUNT; j++) next[i] += unit->push[(size_t)i * INPUTS_COUNT + j] * unit->force[j];
    }
    memcpy(unit->state, next, sizeof next);
    return fmi2OK;
}
API fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
API fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                           const fmi2Integer order[], const fmi2Real values[]) {
    (void)c; (void)vr; (void)order; (void)values;
    return n ? fmi2Error : fmi2OK;
}
API fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                            const fmi2Integer order[], fmi2Real values[]) {
    (void)c; (void)vr; (void)order; (void)values;
    return n ? fmi2Error : fmi2OK;
}
#define STATUS(name, type) \
    API fmi2Status name(fmi2Component c, int kind, type *values) { (void)c; (void)kind; (void)values; return fmi2Discard; }
STATUS(fmi2GetStatus, fmi2Status)
STATUS(fmi2GetRealStatus, fmi2Real)
STATUS(fmi2GetIntegerStatus, fmi2Integer)
STATUS(fmi2GetBooleanStatus, fmi2Boolean)
STATUS(fmi2GetStringStatus, fmi2String)
