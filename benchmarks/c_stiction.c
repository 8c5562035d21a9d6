/* A loop written by hand in C for exactly one model, as c_loop.c: a mass with Coulomb friction and
 * stiction is pulled through a spring for 600 s (164 transitions).
 *
 * At rest the friction is what holds the mass, up to F_S; in motion it is F_C against it, and viscous
 * friction. Dormand-Prince 5(4), max-norm, dense output, every switch located on it, a new small
 * step after each. What is watched is one number: the spring's force at rest, the velocity in
 * motion. All numbers are constants.
 */
#include <math.h>

#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define MIN(a, b) ((a) < (b) ? (a) : (b))

typedef struct { double x, v; } State;

enum { STUCK, FORWARD, BACKWARD };
enum { RELEASE_FORWARD, RELEASE_BACKWARD, ARREST_FORWARD, ARREST_BACKWARD };
enum { COLUMNS = 4, MOST_STOPS = 1000, POINTS = 16 };

static const double RTOL = 1e-6, ATOL = 1e-9, T_END = 600.0, H_START = 0.03;
static const double MASS = 1.0, SPRING = 2.0, SPEED = 0.1, F_C = 1.0, F_S = 1.5, B = 0.1;

typedef struct { State y, rise, bend, twist, bump; double t, h; } Dense;

static inline State plus(State y, double a, State k)
{
    y.x += a * k.x;
    y.v += a * k.v;
    return y;
}

static inline double pull(double t, State y) { return SPRING * (SPEED * t - y.x); }

static inline double friction(int state, double t, State y)
{
    return state == STUCK ? pull(t, y) : (state == FORWARD ? F_C : -F_C) + B * y.v;
}

static inline State flow(int state, double t, State y)
{
    State f = {0.0, 0.0};
    if (state == STUCK) return f;
    f.x = y.v;
    f.v = (pull(t, y) - friction(state, t, y)) / MASS;
    return f;
}

/* Below 0 once the state is left. */
static inline double margin(int state, double t, State y)
{
    return state == STUCK ? F_S - fabs(pull(t, y)) : state == FORWARD ? y.v : -y.v;
}

static inline State at(const Dense *d, double theta)
{
    double rest = 1.0 - theta;
    State y = plus(d->twist, rest, d->bump);
    return plus(d->y, theta, plus(d->rise, rest, plus(d->bend, theta, y)));
}

static inline double look(int state, const Dense *d, double theta)
{
    return margin(state, d->t + theta * d->h, at(d, theta));
}

/* Shrink the bracket to one tick; returns its right end, where the state is left. */
static double bracket(int state, const Dense *d, double low, double high, double tick, double left,
                      double right)
{
    int halve = 0;
    while (high - low > tick) {
        double width = high - low;
        double guess = halve ? low + 0.5 * width : low + width * (left / (left - right));
        guess = MIN(MAX(guess, low + 0.5 * tick), high - 0.5 * tick);
        double seen = look(state, d, guess);
        if (seen < 0.0) {
            high = guess;
            right = seen;
        } else {
            low = guess;
            left = seen;
        }
        halve = high - low > 0.5 * width;
    }
    return high;
}

/* Take the enabled edge, if there is one; returns the total number so far. */
static inline int fire(int *state, double t, State *y, int count, double *times, int *what)
{
    if (!(margin(*state, t, *y) < 0.0)) return count;
    times[count] = t;
    if (*state == STUCK) {
        *state = pull(t, *y) > 0.0 ? FORWARD : BACKWARD;
        what[count] = *state == FORWARD ? RELEASE_FORWARD : RELEASE_BACKWARD;
    } else {
        what[count] = *state == FORWARD ? ARREST_FORWARD : ARREST_BACKWARD;
        *state = STUCK;
        y->v = 0.0;
    }
    return count + 1;
}

static inline void put(int state, double t, State y, double *row)
{
    row[0] = t;
    row[1] = y.x;
    row[2] = y.v;
    row[3] = friction(state, t, y);
}

#define FLOW(c) flow(state, t + (c) * h, y_new)
#define SUM(a, b, c) plus(plus(plus(y, h * (a), k1), h * (b), k2), h * (c), k3)
#define SHARE(u) (fabs(h * e.u) / (ATOL + RTOL * MAX(fabs(y.u), fabs(y_new.u))))

static inline int run(int rows, double *out, double *times, int *what)
{
    Dense d = {.h = 1.0};
    State y = {0.0, 0.0}, none = {0.0, 0.0}, y_new, k1, k2, k3, k4, k5, k6, k7;
    double t = 0.0, spacing = rows > 1 ? T_END / (rows - 1) : 0.0;
    int state = STUCK, count = 0, row = 0;
    for (int stops = 0; t < T_END; stops++) {
        if (stops == MOST_STOPS) return -1;
        count = fire(&state, t, &y, count, times, what);
        double g = margin(state, t, y), h = H_START;
        k1 = flow(state, t, y);
        float before = -13.0f; /* log2 of the last error */
        int rejected = 0, redone = 0;
        for (int crossed = 0; !crossed && t < T_END;) {
            double t_new = t + h;
            if (t_new + 1e-13 >= T_END) {
                t_new = T_END;
                h = T_END - t;
            }
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
            k6 = flow(state, t_new, y_new);
            y_new = plus(plus(y, h * (35.0 / 384.0), k1), h * (500.0 / 1113.0), k3);
            y_new = plus(plus(y_new, h * (125.0 / 192.0), k4), h * (-2187.0 / 6784.0), k5);
            y_new = plus(y_new, h * (11.0 / 84.0), k6);
            k7 = flow(state, t_new, y_new);
            State e = plus(plus(none, 71.0 / 57600.0, k1), -71.0 / 16695.0, k3);
            e = plus(plus(e, 71.0 / 1920.0, k4), -17253.0 / 339200.0, k5);
            e = plus(plus(e, 22.0 / 525.0, k6), -1.0 / 40.0, k7);
            double worst = MAX(SHARE(x), SHARE(v));
            float size = log2f(MAX((float)worst, 1e-10f));
            if (!(worst <= 1.0)) {
                h *= MAX(0.2f, 0.9f * exp2f(-0.2f * size));
                rejected = 1;
                if (!(h > 1e-14)) return -1;
                continue;
            }
            float factor = MAX(0.2f, 0.9f * exp2f(0.08f * before - 0.14f * size));
            double h_next = h * MIN(rejected ? 1.0f : 10.0f, factor);
            before = MAX(size, -13.0f);
            rejected = 0;

            double g_new = margin(state, t_new, y_new), theta = 1.0, deepest = g_new;
            crossed = g_new < 0.0;
            /* May v have changed its sign and changed back? At rest the pull is a straight line. */
            if (!crossed && state != STUCK && k1.v * k7.v < 0.0)
                deepest = MIN(g, g_new) - 0.25 * h * MAX(fabs(k1.v), fabs(k7.v));
            int doubt = crossed || deepest < 0.0;
            if (doubt || (row < rows && row * spacing < t_new)) {
                d.t = t;
                d.h = h;
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
                double left = g, right = g_new, low = 0.0, high = 1.0;
                for (int i = 1; !crossed && i < POINTS; i++) {
                    double point = (double)i / POINTS, seen = look(state, &d, point);
                    crossed = seen < 0.0;
                    *(crossed ? &high : &low) = point;
                    *(crossed ? &right : &left) = seen;
                }
                if (crossed && !redone) { /* the stages lay far beyond: repeat the step */
                    theta = bracket(state, &d, low, high, 0.01, left, right);
                    if (theta < 0.9) {
                        h *= 1.01 * theta;
                        redone = 1;
                        crossed = 0;
                        continue;
                    }
                }
                if (crossed) theta = bracket(state, &d, low, high, 2e-14 / h, left, right);
            }
            redone = 0;
            if (crossed) t_new = t + theta * h;
            for (; row < rows && row * spacing < t_new; row++)
                put(state, row * spacing, at(&d, (row * spacing - t) / h), out + COLUMNS * row);
            y = crossed ? at(&d, theta) : y_new;
            k1 = k7;
            g = g_new;
            t = t_new;
            h = h_next;
        }
    }
    count = fire(&state, t, &y, count, times, what);
    put(state, t, y, out + (rows ? COLUMNS * (rows - 1) : 0));
    return count;
}

/* End state only: out has 4 numbers (t, x, v, F). times and what (the edge) get one entry per
 * transition. Returns their number, or -1. */
int run_end(double *out, double *times, int *what) { return run(0, out, times, what); }

/* The same with evenly spaced rows: out has shape (rows, 4). */
int run_rows(int rows, double *out, double *times, int *what)
{
    return run(rows, out, times, what);
}
