#include "stability/simulation/ode_integrator.h"

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>

#include "stability/simulation/ode_algebra.h"

namespace swarmcert::stability {
namespace {

void check(int status, const char* what) {
  if (status < 0) {
    throw IntegrationError(std::string(what) + " failed with SUNDIALS status " + std::to_string(status));
  }
}

template <typename T>
T* made(T* pointer, const char* what) {
  if (pointer == nullptr) throw IntegrationError(std::string(what) + " failed");
  return pointer;
}

/// Errors are reported by status codes; suppresses SUNDIALS's own messages.
void say_nothing(int, const char*, const char*, char*, void*) {}

}  // namespace

struct OdeIntegrator::Solver {
  OdeMethod method;
  Derivative derivative;
  Events events;
  int num_events = 0;
  double relative;
  SUNContext context = nullptr;
  N_Vector y = nullptr, absolute = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear = nullptr;
  SUNNonlinearSolver nonlinear = nullptr;
  void* memory = nullptr;
  bool is_set_up = false;
  double t = 0;
  long evaluations = 0;

  ~Solver() {
    if (memory != nullptr) method == OdeMethod::kRungeKutta ? ERKStepFree(&memory) : CVodeFree(&memory);
    if (nonlinear != nullptr) SUNNonlinSolFree(nonlinear);
    if (linear != nullptr) SUNLinSolFree(linear);
    if (matrix != nullptr) SUNMatDestroy(matrix);
    if (absolute != nullptr) N_VDestroy(absolute);
    if (y != nullptr) N_VDestroy(y);
    if (context != nullptr) SUNContext_Free(&context);
  }

  static int evaluate(realtype t, N_Vector y, N_Vector dy, void* self) {
    auto* const solver = static_cast<Solver*>(self);
    ++solver->evaluations;
    solver->derivative(t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
    return 0;
  }

  static int watch(realtype t, N_Vector y, realtype* g, void* self) {
    static_cast<Solver*>(self)->events(t, N_VGetArrayPointer(y), g);
    return 0;
  }

  void set_up() {
    constexpr long kMostSteps = 1000000;  // between two stops
    if (method == OdeMethod::kRungeKutta) {
      memory = made(ERKStepCreate(evaluate, t, y, context), "ERKStepCreate");
      check(ERKStepSetErrHandlerFn(memory, say_nothing, nullptr), "ERKStepSetErrHandlerFn");
      check(ERKStepSetUserData(memory, this), "ERKStepSetUserData");
      check(ERKStepSVtolerances(memory, relative, absolute), "ERKStepSVtolerances");
      check(ERKStepSetTableNum(memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
      check(ERKStepSetMaxNumSteps(memory, kMostSteps), "ERKStepSetMaxNumSteps");
      if (num_events > 0) check(ERKStepRootInit(memory, num_events, watch), "ERKStepRootInit");
      return;
    }
    memory = made(CVodeCreate(method == OdeMethod::kBdf ? CV_BDF : CV_ADAMS, context), "CVodeCreate");
    check(CVodeSetErrHandlerFn(memory, say_nothing, nullptr), "CVodeSetErrHandlerFn");
    check(CVodeInit(memory, evaluate, t, y), "CVodeInit");
    check(CVodeSetUserData(memory, this), "CVodeSetUserData");
    check(CVodeSVtolerances(memory, relative, absolute), "CVodeSVtolerances");
    check(CVodeSetMaxNumSteps(memory, kMostSteps), "CVodeSetMaxNumSteps");
    if (method == OdeMethod::kBdf) {
      const sunindextype size = N_VGetLength(y);
      matrix = made(SUNDenseMatrix(size, size, context), "SUNDenseMatrix");
      compute_with_eigen(matrix);
      linear = made(eigen_solver(context), "SUNLinSolNewEmpty");
      check(CVodeSetLinearSolver(memory, linear, matrix), "CVodeSetLinearSolver");
    } else {
      nonlinear = made(SUNNonlinSol_FixedPoint(y, 0, context), "SUNNonlinSol_FixedPoint");
      check(CVodeSetNonlinearSolver(memory, nonlinear), "CVodeSetNonlinearSolver");
    }
    if (num_events > 0) check(CVodeRootInit(memory, num_events, watch), "CVodeRootInit");
  }
};

OdeIntegrator::OdeIntegrator(OdeMethod method, Derivative derivative, double relative,
                             const std::vector<double>& absolute)
    : solver_(std::make_unique<Solver>()) {
  solver_->method = method;
  solver_->derivative = std::move(derivative);
  solver_->relative = relative;
  check(SUNContext_Create(nullptr, &solver_->context), "SUNContext_Create");
  const auto size = static_cast<sunindextype>(absolute.size());
  solver_->y = made(N_VNew_Serial(size, solver_->context), "N_VNew_Serial");
  compute_with_eigen(solver_->y);
  solver_->absolute = made(N_VNew_Serial(size, solver_->context), "N_VNew_Serial");
  std::copy(absolute.begin(), absolute.end(), N_VGetArrayPointer(solver_->absolute));
}

OdeIntegrator::~OdeIntegrator() = default;

void OdeIntegrator::watch(int count, Events events) {
  solver_->num_events = count;
  solver_->events = std::move(events);
}

void OdeIntegrator::start(double t, const double* y) {
  Solver& solver = *solver_;
  solver.t = t;
  double* const state = N_VGetArrayPointer(solver.y);
  if (state != y) std::copy(y, y + N_VGetLength(solver.y), state);
  if (!solver.is_set_up) {
    solver.set_up();
    solver.is_set_up = true;
  } else if (solver.method == OdeMethod::kRungeKutta) {
    check(ERKStepReset(solver.memory, t, solver.y), "ERKStepReset");  // keeps its step size
  } else {
    check(CVodeReInit(solver.memory, t, solver.y), "CVodeReInit");
  }
}

std::vector<int> OdeIntegrator::advance(double target, double limit) {
  Solver& solver = *solver_;
  // SUNDIALS refuses to start over less than a rounding error; there is then nothing to integrate.
  if (target - solver.t <= 1e-13 * (1 + std::abs(target))) return {};
  int status;
  if (solver.method == OdeMethod::kRungeKutta) {
    check(ERKStepSetStopTime(solver.memory, limit), "ERKStepSetStopTime");
    status = ERKStepEvolve(solver.memory, target, solver.y, &solver.t, ARK_NORMAL);
  } else {
    check(CVodeSetStopTime(solver.memory, limit), "CVodeSetStopTime");
    status = CVode(solver.memory, target, solver.y, &solver.t, CV_NORMAL);
  }
  check(status, "the integration");
  static_assert(CV_ROOT_RETURN == ARK_ROOT_RETURN);
  if (status != CV_ROOT_RETURN) return {};
  std::vector<int> signs(static_cast<std::size_t>(solver.num_events));
  check(solver.method == OdeMethod::kRungeKutta ? ERKStepGetRootInfo(solver.memory, signs.data())
                                                : CVodeGetRootInfo(solver.memory, signs.data()),
        "reading the events");
  std::vector<int> found;
  for (int i = 0; i < solver.num_events; ++i) {
    if (signs[static_cast<std::size_t>(i)] != 0) found.push_back(i);
  }
  return found;
}

double OdeIntegrator::time() const { return solver_->t; }

const double* OdeIntegrator::state() const { return N_VGetArrayPointer(solver_->y); }

long OdeIntegrator::evaluations() const { return solver_->evaluations; }

}  // namespace swarmcert::stability
