/* A loop written by hand in C for exactly one model: the reference of compare.py.
 *
 * Four GMS elements under the signed law. A mass is pulled through a spring for 60 s (72
 * transitions); with OPEN_LOOP v = 0.2 sin(2 pi t / 20) is given for 61 s (48 transitions); with
 * SERVO a motor drives the mass through a shaft for 0.2 s (24 transitions), under a PID controller
 * that runs every millisecond. Dormand-Prince 5(4), max-norm, dense output, every crossing located
 * on it, a new small step after each. All numbers are constants; nothing is general.
 *
 *     cc -O3 -march=native -std=c99 -ffp-contract=off -shared -fPIC [-DOPEN_LOOP] c_loop.c -lm
 *
 * Stops: |z| = s of the elements that stick, |v| = v_c and v = 0 while that can matter, and
 * |v| = 6.1 v_s, where the Stribeck curve starts to change: a long step would skip it.
 */
#include <math.h>
#include <string.h>

/* fmax and fmin handle NaN and are function calls. */
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define MIN(a, b) ((a) < (b) ? (a) : (b))

#ifdef SERVO
typedef struct { double z[4], x, v, x_m, v_m; } State;
#else
typedef struct { double z[4], x, v; } State;
#endif

#define ELEMENTS for (int i = 0; i < 4; i++)

enum { STICK, SLIP };
enum { FORWARD, BACKWARD, ARREST };
enum { MOST_STOPS = 1000 };

static const double RTOL = 1e-6, V_C = 1e-6;
#ifdef SERVO
enum { COLUMNS = 11, TICKS = 200 };
static const double ATOL = 1e-12, K[4] = {4e4, 3e4, 2e4, 1e4};
static const double C[4] = {2e-4, 2e-4, 2e-4, 2e-4}, W[4] = {1e-5, 1e-5, 1e-5, 1e-5};
static const double F_C = 1.0, F_S = 1.5, V_S = 1e-3, T_END = 0.2, H_START = 1e-4;
static const double MASS = 1.0, MOTOR = 0.5, SHAFT = 2e4, DAMPING = 5.0, PERIOD = 1e-3;
#define VELOCITY(t, y) ((y).v)
#define ACCELERATION(t, f) ((f).v)
#elif defined OPEN_LOOP
enum { COLUMNS = 8 };
static const double ATOL = 1e-9;
static const double K[4] = {0.7, 0.7, 0.7, 0.7}, SIGMA[4] = {0.3, 0.4, 0.5, 0.6};
static const double C[4] = {0.1, 0.05, 0.025, 1e-4}, W[4] = {1.0, 1.0, 1.0, 1.0};
static const double SIGMA_2 = 0.1, F_C = 0.4, F_S = 1.5, V_S = 1e-3, T_END = 61.0;
static const double OMEGA = 2.0 * 3.14159265358979323846 / 20.0, AMPLITUDE = 0.2;
static const double H_START = 0.01;
#define VELOCITY(t, y) (AMPLITUDE * sin(OMEGA * (t)))
#define ACCELERATION(t, f) ((void)(f), AMPLITUDE * OMEGA * cos(OMEGA * (t)))
#else
enum { COLUMNS = 8 };
static const double ATOL = 1e-9;
static const double K[4] = {40.0, 30.0, 20.0, 10.0}, SIGMA[4] = {0.4, 0.3, 0.2, 0.1};
static const double C[4] = {0.02, 0.02, 0.02, 0.02};
static const double W[4] = {1.0 / 160.0, 1.0 / 120.0, 1.0 / 80.0, 1.0 / 40.0};
static const double SIGMA_2 = 0.4, F_C = 1.0, F_S = 1.5, V_S = 0.05, T_END = 60.0;
static const double MASS = 1.0, SPRING = 2.0, SPEED = 0.1, H_START = 0.03;
#define VELOCITY(t, y) ((y).v)
#define ACCELERATION(t, f) ((f).v)
#endif
#define V_DIP (6.1 * V_S)

typedef struct {
    int state[4];
    double a[4], b[4], c[4]; /* dz = a v + b - c z / S */
    int slips, pinned; /* any element in slip; any watched one with |z| >= s */
    int any_z, watch[4], zone[4];
    double v_low, v_high; /* v stays in [v_low, v_high] as long as nothing changes */
    double u; /* of the controller */
} Arc;

typedef struct { State y, rise, bend, twist, bump; double t, h; } Dense;

static inline double stribeck(double v) /* beyond V_DIP the rest is below rounding */
{
    double u = v * (1.0 / V_S);
    return fabs(v) > V_DIP ? F_C : F_C + (F_S - F_C) * exp(-(u * u));
}

static inline State plus(State y, double a, State k)
{
    ELEMENTS y.z[i] += a * k.z[i];
    y.x += a * k.x;
    y.v += a * k.v;
#ifdef SERVO
    y.x_m += a * k.x_m;
    y.v_m += a * k.v_m;
#endif
    return y;
}

static inline double force(const double *z, const double *dz)
{
    double F = 0.0;
#ifdef SERVO
    (void)dz;
    ELEMENTS F += K[i] * z[i];
#else
    ELEMENTS F += K[i] * z[i] + SIGMA[i] * dz[i];
#endif
    return F;
}

/* Slope with all states frozen; sets s(v) if it is needed. */
static inline State flow(const Arc *arc, double t, double v, State y, double *S)
{
    State f = {.x = v};
    ELEMENTS f.z[i] = arc->a[i] * v + arc->b[i];
    if (arc->slips) {
        double share = 1.0 / (*S = stribeck(v));
        ELEMENTS f.z[i] -= arc->c[i] * y.z[i] * share;
    }
#ifdef SERVO
    (void)t;
    double shaft = SHAFT * (y.x_m - y.x) + DAMPING * (y.v_m - v);
    f.v = (shaft - force(y.z, f.z)) / MASS;
    f.x_m = y.v_m;
    f.v_m = (arc->u - shaft) / MOTOR;
#elif defined OPEN_LOOP
    (void)t;
#else
    f.v = (SPRING * (SPEED * t - y.x) - SIGMA_2 * v - force(y.z, f.z)) / MASS;
#endif
    return f;
}

static inline State at(const Dense *d, double theta)
{
    double rest = 1.0 - theta;
    State y = plus(d->twist, rest, d->bump);
    return plus(d->y, theta, plus(d->rise, rest, plus(d->bend, theta, y)));
}

/* Take every enabled edge, in element order (taking an edge enables no other); returns the total
 * number so far. */
static int fire(Arc *arc, double t, double v, const double *z, int count, double *times, int *what)
{
    double S = stribeck(v);
    for (int i = 0; i < 4; i++) {
        double s = W[i] * S;
        int edge = -1;
        if (arc->state[i] == STICK) {
            if (z[i] >= s && v > V_C) edge = FORWARD;
            else if (z[i] <= -s && v < -V_C) edge = BACKWARD;
        } else if (fabs(v) <= V_C && fabs(z[i]) < s) edge = ARREST;
        if (edge < 0) continue;
        arc->state[i] = edge == ARREST ? STICK : SLIP;
        times[count] = t;
        what[count++] = 3 * i + edge;
    }
    return count;
}

/* Freeze signs and states into coefficients, and choose what to watch. */
static void arm(Arc *arc, double v, const double *z)
{
    double S = stribeck(v), sign = (v > 0.0) - (v < 0.0);
    arc->slips = arc->any_z = arc->pinned = 0;
    for (int i = 0; i < 4; i++) {
        int slip = arc->state[i] == SLIP;
        arc->zone[i] = (z[i] >= W[i] * S) - (z[i] <= -W[i] * S);
        arc->a[i] = slip ? 0.0 : 1.0;
        arc->b[i] = slip ? C[i] * sign : 0.0;
        arc->c[i] = slip ? C[i] / W[i] : 0.0;
        arc->slips |= slip;
        arc->watch[i] = !slip || (fabs(v) <= V_C && arc->zone[i]);
        arc->any_z |= arc->watch[i];
        arc->pinned |= arc->watch[i] && arc->zone[i];
    }
    double speed = fabs(v), low = -V_DIP, high = V_DIP;
    if (speed > V_DIP) {
        low = nextafter(V_DIP, 1.0);
        high = INFINITY;
    } else if (arc->slips || arc->pinned) {
        high = speed > V_C ? V_DIP : speed > 0.0 ? V_C : 0.0;
        low = speed > V_C ? nextafter(V_C, 1.0) : speed > 0.0 ? nextafter(0.0, 1.0) : 0.0;
    }
    arc->v_low = v < 0.0 && low > 0.0 ? -high : low;
    arc->v_high = v < 0.0 && low > 0.0 ? -low : high;
}

/* Margins of all watched comparisons; returns whether one has changed its truth value. */
static inline int changed(const Arc *arc, double S, double v, const double *z, double *g)
{
    int any = !(v >= arc->v_low && v <= arc->v_high);
    g[4] = arc->v_high - v;
    g[5] = v - arc->v_low;
    if (arc->any_z)
        for (int i = 0; i < 4; i++) {
            double s = W[i] * S;
            g[i] = !arc->watch[i] ? 1.0 : arc->zone[i] ? arc->zone[i] * z[i] - s : s - fabs(z[i]);
            any |= arc->zone[i] ? g[i] < 0.0 : g[i] <= 0.0;
        }
    return any;
}

static inline int look(const Arc *arc, const Dense *d, double theta, double *g)
{
    State y = at(d, theta);
    double v = VELOCITY(d->t + theta * d->h, y);
    return changed(arc, arc->any_z ? stribeck(v) : 0.0, v, y.z, g);
}

/* Check m - 1 points in between; returns the first changed one, else -1. */
static double scan(const Arc *arc, const Dense *d, double end, int m, double *low, double *g)
{
    double seen[6];
    for (int i = 1; i < m; i++) {
        double theta = end * i / m;
        if (look(arc, d, theta, seen)) {
            memcpy(g + 6, seen, sizeof seen);
            return theta;
        }
        memcpy(g, seen, sizeof seen);
        *low = theta;
    }
    return -1.0;
}

/* Shrink the bracket to one tick; returns its right end, where the change has happened.
 * g holds six margins at the left end and six at the right. */
static double bracket(const Arc *arc, const Dense *d, double *left, double high, double tick,
                      double *g)
{
    double low = *left, seen[6];
    int halve = 0, first = arc->any_z ? 0 : 4;
    while (high - low > tick) {
        double width = high - low, guess = 0.5 * (low + high);
        if (!halve) {
            guess = high;
            for (int r = first; r < 6; r++)
                if (g[6 + r] <= 0.0 && g[r] > g[6 + r]) {
                    double root = low + width * (g[r] / (g[r] - g[6 + r]));
                    if (root < guess) guess = root;
                }
        }
        if (guess < low + 0.5 * tick) guess = low + 0.5 * tick;
        if (guess > high - 0.5 * tick) guess = high - 0.5 * tick;
        if (look(arc, d, guess, seen)) {
            high = guess;
            memcpy(g + 6, seen, sizeof seen);
        } else {
            low = guess;
            memcpy(g, seen, sizeof seen);
        }
        halve = high - low > 0.5 * width;
    }
    *left = low;
    return high;
}

/* May a comparison have changed and changed back inside the step? Not if |v| and |z| are monotonic:
 * then both are largest, and s smallest, at an end. */
static inline int suspicious(const Arc *arc, double h, const double *z, const double *z_new,
                             double v, double v_new, double a, double a_new, double S, double S_new)
{
    double over = a * a_new > 0.0 ? 0.0 : 0.25 * h * MAX(fabs(a), fabs(a_new));
    if (over > 0.0 && (MAX(v, v_new) + over > arc->v_high || MIN(v, v_new) - over < arc->v_low))
        return 1;
    if (!arc->any_z) return 0;
    if (arc->pinned) return 1;
    double fastest = MAX(fabs(v), fabs(v_new)) + over;
    double farther = v * v_new > 0.0 ? 0.0 : 0.25 * h * fastest;
    double least = over > 0.0 ? stribeck(fastest) : MIN(S, S_new);
    int any = 0;
    for (int i = 0; i < 4; i++)
        any |= arc->watch[i] && MAX(fabs(z[i]), fabs(z_new[i])) + farther >= W[i] * least;
    return any;
}

static inline void put(const Arc *arc, double t, State y, double *row)
{
    double v = VELOCITY(t, y);
    double dz[4], share = arc->slips ? 1.0 / stribeck(v) : 0.0;
    ELEMENTS dz[i] = arc->a[i] * v + arc->b[i] - arc->c[i] * y.z[i] * share;
    row[0] = t;
    row[1] = y.x;
    row[2] = v;
    ELEMENTS row[3 + i] = y.z[i];
#ifdef SERVO
    row[7] = force(y.z, dz);
    row[8] = y.x_m;
    row[9] = y.v_m;
    row[10] = arc->u;
#else
    row[7] = force(y.z, dz) + SIGMA_2 * v;
#endif
}

#define FLOW(c) flow(&arc, t + (c) * h, VELOCITY(t + (c) * h, y_new), y_new, &S_new)
#define SUM(a, b, c) plus(plus(plus(y, h * (a), k1), h * (b), k2), h * (c), k3)
#define SHARE(u) (fabs(h * e.u) / (ATOL + RTOL * MAX(fabs(y.u), fabs(y_new.u))))

static inline int run(int rows, double *out, double *times, int *what)
{
    Arc arc = {.state = {STICK, STICK, STICK, STICK}};
    Dense d;
    State y = {.x = 0.0}, y_new, k1, k2, k3, k4, k5, k6, k7;
    double g[12], t = 0.0, spacing = rows > 1 ? T_END / (rows - 1) : 0.0;
    double t_stop = T_END, h = H_START;
    int count = 0, row = 0;
#ifdef SERVO
    double I = 0.0, e_before = 0.0;
    int tick = 0;
    t_stop = 0.0;
#endif
    for (int stops = 0; t < T_END; stops++) {
        if (stops == MOST_STOPS) return -1;
#ifdef SERVO
        if (t == t_stop) { /* the step stays as long as it was */
            double e = 2e-3 - y.x_m;
            arc.u = 400.0 * e + I + 40.0 * (e - e_before) / PERIOD;
            I += 500.0 * PERIOD * e;
            e_before = e;
            t_stop = ++tick < TICKS ? tick * PERIOD : T_END;
        } else
#endif
            h = H_START;
        double v = VELOCITY(t, y);
        count = fire(&arc, t, v, y.z, count, times, what);
        arm(&arc, v, y.z);
        double S = stribeck(v);
        k1 = flow(&arc, t, v, y, &S);
        double a = ACCELERATION(t, k1);
        changed(&arc, S, v, y.z, g);
        float before = -13.0f; /* log2 of the last error */
        int rejected = 0, redone = 0;
        for (int crossed = 0; !crossed && t < t_stop;) {
            double t_new = t + h, uncut = h;
            if (t_new + 1e-13 >= t_stop) {
                t_new = t_stop;
                h = t_stop - t;
            }
            double S_new = S;
            y_new = plus(y, h * 0.2, k1);
            k2 = FLOW(0.2);
            y_new = plus(plus(y, h * (3.0 / 40.0), k1), h * (9.0 / 40.0), k2);
            k3 = FLOW(0.3);
            y_new = SUM(44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0);
            k4 = FLOW(0.8);
            y_new = SUM(19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0);
            y_new = plus(y_new, h * (-212.0 / 729.0), k4);
            k5 = FLOW(8.0 / 9.0);
            y_new = SUM(9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0);
            y_new = plus(plus(y_new, h * (49.0 / 176.0), k4), h * (-5103.0 / 18656.0), k5);
            double v_new = VELOCITY(t_new, y_new);
            k6 = flow(&arc, t_new, v_new, y_new, &S_new);
            y_new = plus(plus(y, h * (35.0 / 384.0), k1), h * (500.0 / 1113.0), k3);
            y_new = plus(plus(y_new, h * (125.0 / 192.0), k4), h * (-2187.0 / 6784.0), k5);
            y_new = plus(y_new, h * (11.0 / 84.0), k6);
#ifndef OPEN_LOOP
            v_new = y_new.v;
#endif
            k7 = flow(&arc, t_new, v_new, y_new, &S_new);
            State e = {.x = 0.0};
            e = plus(plus(e, 71.0 / 57600.0, k1), -71.0 / 16695.0, k3);
            e = plus(plus(e, 71.0 / 1920.0, k4), -17253.0 / 339200.0, k5);
            e = plus(plus(e, 22.0 / 525.0, k6), -1.0 / 40.0, k7);
            double worst = MAX(SHARE(x), SHARE(v));
#ifdef SERVO
            worst = MAX(worst, MAX(SHARE(x_m), SHARE(v_m)));
#endif
            ELEMENTS worst = MAX(worst, SHARE(z[i]));
            float size = log2f(MAX((float)worst, 1e-10f));
            if (!(worst <= 1.0)) {
                h *= MAX(0.2f, 0.9f * exp2f(-0.2f * size));
                rejected = 1;
                if (!(h > 1e-14)) return -1;
                continue;
            }
            float factor = MAX(0.2f, 0.9f * exp2f(0.08f * before - 0.14f * size));
            double h_next = h * MIN(rejected ? 1.0f : 10.0f, factor);
            if (uncut > h && !rejected) h_next = MAX(h_next, uncut);
            before = MAX(size, -13.0f);
            rejected = 0;

            if (arc.any_z && !arc.slips) S_new = stribeck(v_new);
            double a_new = ACCELERATION(t_new, k7), theta = 1.0;
            crossed = changed(&arc, S_new, v_new, y_new.z, g + 6);
            int doubt = crossed || suspicious(&arc, h, y.z, y_new.z, v, v_new, a, a_new, S, S_new);
            if (doubt || (row < rows && row * spacing < t_new)) {
                d.t = t;
                d.h = h;
                State none = {.x = 0.0};
                d.y = y;
                d.rise = plus(y_new, -1.0, y);
                d.bend = plus(plus(none, h, k1), -1.0, d.rise);
                d.twist = plus(plus(d.rise, -h, k7), -1.0, d.bend);
                d.bump = plus(none, -12715105075.0 / 11282082432.0 * h, k1);
                d.bump = plus(d.bump, 87487479700.0 / 32700410799.0 * h, k3);
                d.bump = plus(d.bump, -10690763975.0 / 1880347072.0 * h, k4);
                d.bump = plus(d.bump, 701980252875.0 / 199316789632.0 * h, k5);
                d.bump = plus(d.bump, -1453857185.0 / 822651844.0 * h, k6);
                d.bump = plus(d.bump, 69997945.0 / 29380423.0 * h, k7);
            }
            if (doubt) {
                double tick = 2e-14 / h, last[6], low = 0.0, quiet = 1.0, found = 1.0;
                memcpy(last, g + 6, sizeof last);
                if (crossed) {
                    found = bracket(&arc, &d, &low, 1.0, 0.01, g);
                    if (found < 0.9 && !redone) { /* the stages lay far beyond: repeat the step */
                        h *= 1.01 * found;
                        redone = 1;
                        crossed = 0;
                        changed(&arc, S, v, y.z, g);
                        continue;
                    }
                    theta = bracket(&arc, &d, &low, found, tick, g);
                    State y_low = at(&d, quiet = low);
                    double t_low = t + low * h, v_low = VELOCITY(t_low, y_low), S_low = 0.0;
                    State f = flow(&arc, t_low, v_low, y_low, &S_low);
                    if (arc.any_z && !arc.slips) S_low = stribeck(v_low);
                    doubt = suspicious(&arc, low * h, y.z, y_low.z, v, v_low, a,
                                       ACCELERATION(t_low, f), S, S_low);
                }
                while (doubt) { /* is there an earlier one? */
                    changed(&arc, S, v, y.z, g);
                    low = 0.0;
                    if ((found = scan(&arc, &d, quiet, 16, &low, g)) < 0.0) break;
                    crossed = 1;
                    theta = bracket(&arc, &d, &low, found, tick, g);
                    quiet = low;
                }
                if (!crossed) memcpy(g + 6, last, sizeof last);
            }
            redone = 0;
            if (crossed) t_new = t + theta * h;
            for (; row < rows && row * spacing < t_new; row++)
                put(&arc, row * spacing, at(&d, (row * spacing - t) / h), out + COLUMNS * row);
            if (crossed) y = at(&d, theta);
            else {
                y = y_new;
                k1 = k7;
                memcpy(g, g + 6, 6 * sizeof *g);
            }
            t = t_new;
            v = v_new;
            S = S_new;
            a = a_new;
            h = h_next;
        }
    }
    count = fire(&arc, t, VELOCITY(t, y), y.z, count, times, what);
    arm(&arc, VELOCITY(t, y), y.z);
    put(&arc, t, y, out + (rows ? COLUMNS * (rows - 1) : 0));
    return count;
}

/* End state only: out has 8 numbers (t, x, v, z1..z4, F; of the servo 3 more: x_m, v_m, u). times and what (3 * element + edge; edges
 * forward, backward, arrest) get one entry per transition. Returns their number, or -1. */
int run_end(double *out, double *times, int *what) { return run(0, out, times, what); }

/* The same with evenly spaced rows: out has shape (rows, 8), or (rows, 11). */
int run_rows(int rows, double *out, double *times, int *what)
{
    return run(rows, out, times, what);
}
