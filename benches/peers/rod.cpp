// The benchmark scene as a researcher writes it by hand for speed: fixed steps of DOP853 or RK4, columns beside the rod as
// the variational equations (w, dp, dm of each), loops over columns that the compiler vectorises, Newton's method on the
// base moment from rest under growing loads with half the steps, the Jacobian by the implicit function theorem.
//
// Units, parameters and state are those of rod.py. Built by by_cpp.py with -O3 -march=native -ffast-math.
#include <algorithm>
#include <cmath>

namespace {

constexpr int PARAMETERS = 17;
constexpr int MOMENT = 3;
constexpr int ALL = MOMENT + PARAMETERS;
// p, then R by rows, then m.
constexpr int STATE = 15;

struct Tableau {
    int stages;
    const double *a, *b;
};

struct Scene {
    double turns_area[9], field[3], rigid, distal;
};

template <int N>
struct Rod {
    double y[STATE];
    // w, dp, dm of each column.
    double w[3][N], p[3][N], m[3][N];
};

struct Segment {
    double length, u_star[3], bending, torsion;
    double n[3];
    // Where the columns of its own parameters begin.
    int own;
};

template <int N>
void slope(const Rod<N> &x, const Segment &s, Rod<N> &d) {
    const double *R = x.y + 3, *m = x.y + 12;
    const double ib = 1.0 / s.bending, it = 1.0 / s.torsion;
    double b[3], u[3], nb[3];
    for (int i = 0; i < 3; i++) b[i] = R[i] * m[0] + R[3 + i] * m[1] + R[6 + i] * m[2];
    for (int i = 0; i < 3; i++) nb[i] = R[i] * s.n[0] + R[3 + i] * s.n[1] + R[6 + i] * s.n[2];
    const double inverse[3] = {ib, ib, it};
    for (int i = 0; i < 3; i++) u[i] = s.u_star[i] + b[i] * inverse[i];
    const double t[3] = {R[2], R[5], R[8]};
    for (int i = 0; i < 3; i++) {
        d.y[i] = t[i];
        d.y[3 + 3 * i] = R[3 * i + 1] * u[2] - R[3 * i + 2] * u[1];
        d.y[4 + 3 * i] = R[3 * i + 2] * u[0] - R[3 * i] * u[2];
        d.y[5 + 3 * i] = R[3 * i] * u[1] - R[3 * i + 1] * u[0];
    }
    d.y[12] = s.n[1] * t[2] - s.n[2] * t[1];
    d.y[13] = s.n[2] * t[0] - s.n[0] * t[2];
    d.y[14] = s.n[0] * t[1] - s.n[1] * t[0];
    // In the world frame: w' = R du, dp' = w x t, dm' = dn x t + n x (w x t), du = du* + K^-1 (R^T (dm - w x m)) + dK.
    for (int k = 0; k < N; k++) {
        const double w0 = x.w[0][k], w1 = x.w[1][k], w2 = x.w[2][k];
        const double g0 = x.m[0][k] - (w1 * m[2] - w2 * m[1]);
        const double g1 = x.m[1][k] - (w2 * m[0] - w0 * m[2]);
        const double g2 = x.m[2][k] - (w0 * m[1] - w1 * m[0]);
        const double du0 = (R[0] * g0 + R[3] * g1 + R[6] * g2) * ib;
        const double du1 = (R[1] * g0 + R[4] * g1 + R[7] * g2) * ib;
        const double du2 = (R[2] * g0 + R[5] * g1 + R[8] * g2) * it;
        d.w[0][k] = R[0] * du0 + R[1] * du1 + R[2] * du2;
        d.w[1][k] = R[3] * du0 + R[4] * du1 + R[5] * du2;
        d.w[2][k] = R[6] * du0 + R[7] * du1 + R[8] * du2;
        const double q0 = w1 * t[2] - w2 * t[1], q1 = w2 * t[0] - w0 * t[2], q2 = w0 * t[1] - w1 * t[0];
        d.p[0][k] = q0;
        d.p[1][k] = q1;
        d.p[2][k] = q2;
        d.m[0][k] = s.n[1] * q2 - s.n[2] * q1;
        d.m[1][k] = s.n[2] * q0 - s.n[0] * q2;
        d.m[2][k] = s.n[0] * q1 - s.n[1] * q0;
    }
    if constexpr (N == ALL) {
        // By the tip force, whose n is the same along the rod.
        for (int i = 0; i < 3; i++) {
            const int k = MOMENT + 3 + i, j = (i + 1) % 3, l = (i + 2) % 3;
            d.m[j][k] -= t[l];
            d.m[l][k] += t[j];
        }
        // By rest curvature and stiffness of this segment.
        for (int i = 0; i < 3; i++) {
            for (int r = 0; r < 3; r++) {
                d.w[r][MOMENT + s.own + i] += R[3 * r + i];
                d.w[r][MOMENT + s.own + 3] -= i < 2 ? R[3 * r + i] * b[i] * ib * ib : 0.0;
            }
        }
        for (int r = 0; r < 3; r++) d.w[r][MOMENT + s.own + 4] -= R[3 * r + 2] * b[2] * it * it;
    }
}

template <int N>
void step(Rod<N> &x, double h, const Segment &s, const Tableau &method) {
    constexpr int SIZE = sizeof(Rod<N>) / sizeof(double);
    static thread_local Rod<N> k[12];
    for (int i = 0; i < method.stages; i++) {
        alignas(64) Rod<N> at = x;
        double *to = reinterpret_cast<double *>(&at);
        for (int j = 0; j < i; j++) {
            const double a = h * method.a[i * method.stages + j];
            if (a == 0.0) continue;
            const double *from = reinterpret_cast<const double *>(&k[j]);
            for (int e = 0; e < SIZE; e++) to[e] += a * from[e];
        }
        slope(at, s, k[i]);
    }
    double *to = reinterpret_cast<double *>(&x);
    for (int j = 0; j < method.stages; j++) {
        const double b = h * method.b[j];
        if (b == 0.0) continue;
        const double *from = reinterpret_cast<const double *>(&k[j]);
        for (int e = 0; e < SIZE; e++) to[e] += b * from[e];
    }
}

// From the base with its moment to the tip.
template <int N>
Rod<N> shoot(const Scene &scene, const double *theta, const double *m0, double load, const int *steps, const Tableau &method) {
    Rod<N> x = {};
    x.y[3] = x.y[7] = x.y[11] = 1.0;
    for (int i = 0; i < 3; i++) {
        x.y[12 + i] = m0[i];
        x.m[i][i] = 1.0;
    }
    for (int j = 0; j < 2; j++) {
        const double *own = theta + 7 + 5 * j;
        Segment s = {j == 0 ? theta[6] : scene.distal, {own[0], own[1], own[2]}, own[3], own[4], {}, 7 + 5 * j};
        for (int i = 0; i < 3; i++) s.n[i] = load * theta[3 + i];
        for (int i = 0; i < steps[j]; i++) step(x, s.length / steps[j], s, method);
        if (j != 0) break;
        double *R = x.y + 3;
        if constexpr (N == ALL) {
            // A longer segment ends later.
            Rod<N> d;
            slope(x, s, d);
            const double b[3] = {d.y[12], d.y[13], d.y[14]};
            double u[3];
            for (int i = 0; i < 3; i++) {
                const double moment = R[i] * x.y[12] + R[3 + i] * x.y[13] + R[6 + i] * x.y[14];
                u[i] = s.u_star[i] + moment / (i < 2 ? s.bending : s.torsion);
            }
            for (int r = 0; r < 3; r++) {
                x.w[r][MOMENT + 6] += R[3 * r] * u[0] + R[3 * r + 1] * u[1] + R[3 * r + 2] * u[2];
                x.p[r][MOMENT + 6] += R[3 * r + 2];
                x.m[r][MOMENT + 6] += b[r];
            }
        }
        // Over the coil: its dipole's torque, the lever arm of the force.
        double dipole[3], arm[3], body[3];
        for (int i = 0; i < 3; i++) {
            const double *a = scene.turns_area + 3 * i;
            body[i] = load * (a[0] * theta[0] + a[1] * theta[1] + a[2] * theta[2]);
            arm[i] = scene.rigid * R[3 * i + 2];
        }
        for (int r = 0; r < 3; r++) dipole[r] = R[3 * r] * body[0] + R[3 * r + 1] * body[1] + R[3 * r + 2] * body[2];
        const double *B = scene.field;
        for (int r = 0; r < 3; r++) {
            const int i = (r + 1) % 3, l = (r + 2) % 3;
            x.y[r] += arm[r];
            x.y[12 + r] -= dipole[i] * B[l] - dipole[l] * B[i] + arm[i] * s.n[l] - arm[l] * s.n[i];
        }
        for (int k = 0; k < N; k++) {
            double dd[3], da[3];
            for (int r = 0; r < 3; r++) {
                const int i = (r + 1) % 3, l = (r + 2) % 3;
                dd[r] = x.w[i][k] * dipole[l] - x.w[l][k] * dipole[i];
                da[r] = x.w[i][k] * arm[l] - x.w[l][k] * arm[i];
            }
            if (k >= MOMENT && k < MOMENT + 3) {
                for (int r = 0; r < 3; r++) {
                    for (int i = 0; i < 3; i++) dd[r] += load * R[3 * r + i] * scene.turns_area[3 * i + k - MOMENT];
                }
            }
            for (int r = 0; r < 3; r++) {
                const int i = (r + 1) % 3, l = (r + 2) % 3;
                x.p[r][k] += da[r];
                x.m[r][k] -= dd[i] * B[l] - dd[l] * B[i] + da[i] * s.n[l] - da[l] * s.n[i];
            }
            if (k >= MOMENT + 3 && k < MOMENT + 6) {
                const int f = k - MOMENT - 3, i = (f + 1) % 3, l = (f + 2) % 3;
                // arm x e_f
                x.m[l][k] += arm[i];
                x.m[i][k] -= arm[l];
            }
        }
    }
    return x;
}

// Solves W x = r for each of N right-hand sides.
template <int N>
void solve(const double W[3][3], const double (*r)[N], double (*x)[N]) {
    double inverse[3][3];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            inverse[i][j] = W[a][c] * W[b][d] - W[a][d] * W[b][c];
        }
    }
    const double determinant = W[0][0] * inverse[0][0] + W[0][1] * inverse[1][0] + W[0][2] * inverse[2][0];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < N; k++) {
            x[i][k] = (inverse[i][0] * r[0][k] + inverse[i][1] * r[1][k] + inverse[i][2] * r[2][k]) / determinant;
        }
    }
}

template <int N>
double newton(const Rod<N> &x, double *m0) {
    double W[3][3], r[3][1], d[3][1];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) W[i][j] = x.m[i][j];
        r[i][0] = x.y[12 + i];
    }
    solve<1>(W, r, d);
    double largest = 0.0;
    for (int i = 0; i < 3; i++) {
        m0[i] -= d[i][0];
        largest = std::max(largest, std::fabs(d[i][0]));
    }
    return largest;
}

}  // namespace

// Tips (15 each) and Jacobians (15 x 17) of `count` samples from rest.
extern "C" void solve_samples(
    int count, const double *thetas, const Scene *scene, int stages, const double *a, const double *b, const int *steps,
    double tolerance, double *tips, double *jacobians
) {
    const Tableau method = {stages, a, b};
    const int half[2] = {std::max(1, steps[0] / 2), std::max(1, steps[1] / 2)};
    for (int sample = 0; sample < count; sample++) {
        const double *theta = thetas + PARAMETERS * sample;
        double m0[3] = {}, before[3] = {};
        for (int load = 1; load <= 4; load++) {
            for (int i = 0; i < 3; i++) {
                const double now = m0[i];
                m0[i] = 2.0 * now - before[i];
                before[i] = now;
            }
            for (int pass = 0; pass < 10; pass++) {
                const Rod<MOMENT> x = shoot<MOMENT>(*scene, theta, m0, 0.25 * load, half, method);
                if (newton(x, m0) < 0.05) break;
            }
        }
        // Newton's method squares its errors: what is left after the last step is below the tolerance.
        for (int pass = 0; pass < 10; pass++) {
            const Rod<MOMENT> x = shoot<MOMENT>(*scene, theta, m0, 1.0, steps, method);
            if (newton(x, m0) < std::sqrt(tolerance)) break;
        }
        const Rod<ALL> x = shoot<ALL>(*scene, theta, m0, 1.0, steps, method);
        double W[3][3], r[3][PARAMETERS], d[3][PARAMETERS];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) W[i][j] = x.m[i][j];
            for (int k = 0; k < PARAMETERS; k++) r[i][k] = x.m[i][MOMENT + k];
        }
        solve<PARAMETERS>(W, r, d);
        double *tip = tips + STATE * sample, *jacobian = jacobians + STATE * PARAMETERS * sample;
        std::copy(x.y, x.y + STATE, tip);
        for (int k = 0; k < PARAMETERS; k++) {
            double p[3], w[3];
            for (int i = 0; i < 3; i++) {
                p[i] = x.p[i][MOMENT + k];
                w[i] = x.w[i][MOMENT + k];
                for (int j = 0; j < 3; j++) {
                    p[i] -= x.p[i][j] * d[j][k];
                    w[i] -= x.w[i][j] * d[j][k];
                }
            }
            for (int i = 0; i < 3; i++) {
                jacobian[i * PARAMETERS + k] = p[i];
                // dR = hat(w) R
                const int j = (i + 1) % 3, l = (i + 2) % 3;
                for (int c = 0; c < 3; c++) {
                    jacobian[(3 + 3 * i + c) * PARAMETERS + k] = w[j] * x.y[3 + 3 * l + c] - w[l] * x.y[3 + 3 * j + c];
                }
            }
        }
    }
}
