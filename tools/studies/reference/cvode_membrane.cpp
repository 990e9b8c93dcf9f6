#include "tools/studies/reference/cvode_membrane.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "tools/studies/reference/sundials.hpp"

namespace merkel::reference {
namespace {

constexpr double kRest = -65.0;
constexpr double kThreshold = -20.0;

double ratio(double x) {
  return std::fabs(x) < 1e-6 ? 1.0 - x / 2.0 + x * x / 12.0 : x / std::expm1(x);
}

struct Rates {
  double an, bn, am, bm, ah, bh;
};

Rates rates_at(double V) {
  const double u = V - kRest;
  return {0.1 * ratio(1.0 - u / 10.0), 0.125 * std::exp(-u / 80.0),
          ratio(2.5 - u / 10.0),       4.0 * std::exp(-u / 18.0),
          0.07 * std::exp(-u / 20.0),  1.0 / (1.0 + std::exp(3.0 - u / 10.0))};
}

double ionic(double V, double n, double m, double h, double g_CaL, double leak) {
  return 0.3 * (leak - V) + 120.0 * m * m * m * h * (50.0 - V) +
         36.0 * n * n * n * n * (-77.0 - V) + g_CaL * m * h * (120.0 - V);
}

struct Problem {
  const CvodeMembranes* membranes;
  double leak;
};

int derivative(double t, N_Vector y, N_Vector dy, void* data) {
  const auto& problem = *static_cast<const Problem*>(data);
  const CvodeMembranes& what = *problem.membranes;
  const double* const s = NV_DATA_S(y);
  double* const d = NV_DATA_S(dy);
  for (int i = 0; i < what.neurons; ++i) {
    const double V = s[4 * i];
    const double n = s[4 * i + 1];
    const double m = s[4 * i + 2];
    const double h = s[4 * i + 3];
    const Rates k = rates_at(V);
    double total = ionic(V, n, m, h, what.g_CaL, problem.leak) + what.current(i, t);
    if (!what.coupling.empty()) {
      for (int j = 0; j < what.neurons; ++j) {
        total += what.coupling[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] *
                 (s[4 * j] - V);
      }
    }
    d[4 * i] = total;
    d[4 * i + 1] = k.an * (1.0 - n) - k.bn * n;
    d[4 * i + 2] = k.am * (1.0 - m) - k.bm * m;
    d[4 * i + 3] = k.ah * (1.0 - h) - k.bh * h;
  }
  return 0;
}

int threshold_distance(double /*t*/, N_Vector y, double* g, void* data) {
  const auto& problem = *static_cast<const Problem*>(data);
  for (int i = 0; i < problem.membranes->neurons; ++i) g[i] = NV_DATA_S(y)[4 * i] - kThreshold;
  return 0;
}

void require(int status, const char* what) {
  if (status < 0) throw std::runtime_error(std::string("CVODE: ") + what + " failed");
}

}  // namespace

std::vector<CvodeMembranes::Spike> CvodeMembranes::spikes_until(double end_ms) const {
  const Rates k = rates_at(kRest);
  const double n0 = k.an / (k.an + k.bn);
  const double m0 = k.am / (k.am + k.bm);
  const double h0 = k.ah / (k.ah + k.bh);
  Problem problem{this, kRest - ionic(kRest, n0, m0, h0, g_CaL, kRest) / 0.3};

  SUNContext context = nullptr;
  require(SUNContext_Create(SUN_COMM_NULL, &context), "SUNContext_Create");
  const sunindextype size = 4 * neurons;
  N_Vector y = N_VNew_Serial(size, context);
  for (int i = 0; i < neurons; ++i) {
    double* const s = NV_DATA_S(y) + 4 * i;
    s[0] = kRest;
    s[1] = n0;
    s[2] = m0;
    s[3] = h0;
  }
  void* solver = CVodeCreate(CV_BDF, context);
  require(CVodeInit(solver, derivative, 0.0, y), "CVodeInit");
  require(CVodeSStolerances(solver, relative_tolerance, absolute_tolerance), "tolerances");
  SUNMatrix matrix = SUNDenseMatrix(size, size, context);
  SUNLinearSolver linear = SUNLinSol_Dense(y, matrix, context);
  require(CVodeSetLinearSolver(solver, linear, matrix), "CVodeSetLinearSolver");
  require(CVodeSetUserData(solver, &problem), "CVodeSetUserData");
  require(CVodeSetMaxNumSteps(solver, 100'000'000), "CVodeSetMaxNumSteps");
  require(CVodeRootInit(solver, neurons, threshold_distance), "CVodeRootInit");
  std::vector<int> upward(static_cast<std::size_t>(neurons), 1);
  require(CVodeSetRootDirection(solver, upward.data()), "CVodeSetRootDirection");

  std::vector<double> stops;
  for (const double corner : corners) {
    if (corner > 0.0 && corner < end_ms) stops.push_back(corner);
  }
  std::sort(stops.begin(), stops.end());
  stops.push_back(end_ms);
  std::vector<Spike> spikes;
  std::vector<int> found(static_cast<std::size_t>(neurons));
  double t = 0.0;
  for (const double stop : stops) {
    require(CVodeSetStopTime(solver, stop), "CVodeSetStopTime");
    for (;;) {
      const int status = CVode(solver, stop, y, &t, CV_NORMAL);
      require(status, "CVode");
      if (status == CV_ROOT_RETURN) {
        require(CVodeGetRootInfo(solver, found.data()), "CVodeGetRootInfo");
        for (int i = 0; i < neurons; ++i) {
          if (found[static_cast<std::size_t>(i)] > 0) spikes.push_back({i, t});
        }
        continue;
      }
      break;
    }
    if (stop < end_ms) require(CVodeReInit(solver, stop, y), "CVodeReInit");
  }
  CVodeFree(&solver);
  SUNLinSolFree(linear);
  SUNMatDestroy(matrix);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return spikes;
}

}  // namespace merkel::reference
