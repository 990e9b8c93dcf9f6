#include "tools/studies/reference/cvode_connor_stevens.hpp"

#include <cmath>
#include <stdexcept>

#include "tools/studies/reference/sundials.hpp"

namespace merkel::reference {
namespace {

using Current = std::function<double(double)>;

double over(double x) { return std::fabs(x) < 1e-7 ? 10.0 : x / (1.0 - std::exp(-0.1 * x)); }

int connor_stevens_derivative(double t, N_Vector y, N_Vector dy, void* data) {
  const double* const s = NV_DATA_S(y);
  double* const d = NV_DATA_S(dy);
  const double V = s[0];
  d[0] = 0.3 * (-17.0 - V) + 120.0 * std::pow(s[1], 3) * s[2] * (55.0 - V) +
         20.0 * std::pow(s[3], 4) * (-72.0 - V) + 47.7 * std::pow(s[4], 3) * s[5] * (-75.0 - V) +
         (*static_cast<const Current*>(data))(t);
  d[1] = 0.38 * over(V + 29.7) * (1.0 - s[1]) - 15.2 * std::exp(-0.0556 * (V + 54.7)) * s[1];
  d[2] = 0.266 * std::exp(-0.05 * (V + 48.0)) * (1.0 - s[2]) -
         3.8 / (1.0 + std::exp(-0.1 * (V + 18.0))) * s[2];
  d[3] = 0.02 * over(V + 45.7) * (1.0 - s[3]) - 0.25 * std::exp(-0.0125 * (V + 55.7)) * s[3];
  const double a =
      std::cbrt(0.0761 * std::exp(0.0314 * (V + 94.22)) / (1.0 + std::exp(0.0346 * (V + 1.17))));
  d[4] = (a - s[4]) / (0.3632 + 1.158 / (1.0 + std::exp(0.0497 * (V + 55.96))));
  const double b = std::pow(1.0 / (1.0 + std::exp(0.0688 * (V + 53.3))), 4);
  d[5] = (b - s[5]) / (1.24 + 2.678 / (1.0 + std::exp(0.0624 * (V + 50.0))));
  return 0;
}

int connor_stevens_threshold(double /*t*/, N_Vector y, double* g, void* /*data*/) {
  g[0] = NV_DATA_S(y)[0] + 20.0;
  return 0;
}

void require(int status) {
  if (status < 0) throw std::runtime_error("CVODE failed");
}

}  // namespace

std::vector<double> connor_stevens_spikes(const Current& current, double end_ms) {
  SUNContext context = nullptr;
  require(SUNContext_Create(SUN_COMM_NULL, &context));
  N_Vector y = N_VNew_Serial(6, context);
  const double start[] = {-68.0, 0.0101, 0.9659, 0.1559, 0.5404, 0.2885};
  for (int i = 0; i < 6; ++i) NV_DATA_S(y)[i] = start[i];
  void* solver = CVodeCreate(CV_BDF, context);
  Current none = [](double) { return 0.0; };
  require(CVodeInit(solver, connor_stevens_derivative, 0.0, y));
  require(CVodeSStolerances(solver, 1e-10, 1e-12));
  SUNMatrix matrix = SUNDenseMatrix(6, 6, context);
  SUNLinearSolver linear = SUNLinSol_Dense(y, matrix, context);
  require(CVodeSetLinearSolver(solver, linear, matrix));
  require(CVodeSetMaxNumSteps(solver, 100'000'000));
  double t = 0.0;
  // First integrate to rest, then apply the current.
  require(CVodeSetUserData(solver, &none));
  require(CVode(solver, 2000.0, y, &t, CV_NORMAL));
  Current own = current;
  require(CVodeSetUserData(solver, &own));
  require(CVodeReInit(solver, 0.0, y));
  require(CVodeRootInit(solver, 1, connor_stevens_threshold));
  int upward = 1;
  require(CVodeSetRootDirection(solver, &upward));
  require(CVodeSetStopTime(solver, end_ms));
  std::vector<double> spikes;
  for (;;) {
    const int status = CVode(solver, end_ms, y, &t, CV_NORMAL);
    require(status);
    if (status != CV_ROOT_RETURN) break;
    spikes.push_back(t);
  }
  CVodeFree(&solver);
  SUNLinSolFree(linear);
  SUNMatDestroy(matrix);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return spikes;
}

}  // namespace merkel::reference
