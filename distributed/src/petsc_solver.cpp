// SPDX-License-Identifier: GPL-3.0-or-later
#include "petsc_solver.hpp"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <limits>
#include <string_view>
#include <vector>

#include "radiosity/formfactors/form_factor_operator.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* general = nullptr;
  char* specific = nullptr;
  PetscErrorMessage(code, &general, &specific);
  throw InputError(fmt::format("PETSc: {}{}{}", general != nullptr ? general : "error",
                               specific != nullptr && *specific != 0 ? ": " : "",
                               specific != nullptr ? specific : ""));
}

// A PETSc object, and its end.
template <class Object, PetscErrorCode (*destroy)(Object*)>
class Owned {
 public:
  Owned() = default;
  ~Owned() { destroy(&object_); }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  Object* operator&() { return &object_; }
  operator Object() const { return object_; }  // NOLINT: it stands for it

 private:
  Object object_ = nullptr;
};

/// M B = W E as in our own conjugate gradients, for all bands and components at once, B = γ + w: the operator is
///   M − (W ρs)(W ρs)ᵀ / Σ W ρs    of each band and component, applied with ⟨1, q⟩ in place of (W ρs)ᵀ p, which is the same,
/// preconditioned by W = diag(A/ρ). A rank has the rows that it owns in its part of each vector, the bands of a patch side by side.
class DeflatedSystem {
 public:
  DeflatedSystem(const RadiositySystem& system, const DistributedFormFactors& f)
      : system_(system), f_(f), rho_(system.reflectance()) {
    for (Index i = 0; i < f.rows(); ++i)
      if (f.ranks().owns(i)) own_.push_back(i);
    const BandArray area = system.areas().replicate(1, system.bands());
    reflects_ = (rho_ > tolerance::kBlack).cast<double>();
    weight_ = divide_or_zero(area, reflects_ * rho_);
    loss_ = system.absorptance() + rho_.colwise() * system.escaped();
    if ((reflects_ == 0).any()) {
      BandArray black;
      f.apply(1 - reflects_, black);
      loss_ += rho_ * black;
    }
    loss_ *= reflects_;
    sink_ = system.sums(weight_ * loss_);
    emitted_ = system.sums(area * system.emission());
  }

  PetscInt own_size() const { return static_cast<PetscInt>(own_.size()) * system_.bands(); }

  /// r = E − B + ρFB of B = w, and γ with ⟨1, W r⟩ = 0, which is then taken from it.
  BandArray residual(const BandArray& w, BandArray& gamma) const {
    BandArray gathered;
    f_.apply(w, gathered);
    BandArray r = reflects_ * (system_.emission() - w + rho_ * gathered);
    gamma = divide_or_zero(system_.sums(weight_ * r), sink_);
    r -= loss_ * system_.spread(gamma);
    return r;
  }
  BandArray radiosity(const BandArray& w, const BandArray& gamma) const {
    return w + reflects_ * system_.spread(gamma);
  }
  /// What γ changes by when w changes by x, as far as F is reciprocal.
  BandArray change_of_gamma(const BandArray& x) const {
    return -divide_or_zero(system_.sums(weight_ * loss_ * x), sink_);
  }

  /// power_share of r where W r is in PETSc's vector.
  double share_of(Vec residual_vector) const {
    BandArray sums = BandArray::Zero(system_.components(), system_.bands());
    const double* r = nullptr;
    check(VecGetArrayRead(residual_vector, &r));
    for (std::size_t k = 0; k < own_.size(); ++k)
      for (Index b = 0; b < system_.bands(); ++b, ++r)
        sums(component(own_[k]), b) += std::abs(*r) * rho_(own_[k], b);  // A/W = ρ
    r -= own_size();
    check(VecRestoreArrayRead(residual_vector, &r));
    const BandArray shares = divide_or_zero(over_ranks(std::move(sums)), emitted_);
    return shares.size() > 0 ? shares.maxCoeff() : 0;
  }

  /// y = W (deflated I − ρF) x.
  void multiply(Vec x, Vec y) const {
    const BandArray p = whole(x);
    BandArray q;
    f_.own().apply(p, q);
    BandArray sums = BandArray::Zero(system_.components(), system_.bands());
    for (const Index i : own_) {
      q.row(i) = weight_.row(i) * (p.row(i) - rho_.row(i) * q.row(i));
      sums.row(component(i)) += q.row(i);
    }
    const BandArray mu = divide_or_zero(over_ranks(std::move(sums)), sink_);
    for (const Index i : own_) q.row(i) -= weight_.row(i) * loss_.row(i) * mu.row(component(i));
    set(y, q);
  }
  /// z = W⁻¹ r.
  void precondition(Vec r, Vec z) const {
    const double* from = nullptr;
    double* to = nullptr;
    check(VecGetArrayRead(r, &from));
    check(VecGetArrayWrite(z, &to));
    PetscInt k = 0;
    for (const Index i : own_)
      for (Index b = 0; b < system_.bands(); ++b, ++k)
        to[k] = weight_(i, b) > 0 ? from[k] / weight_(i, b) : 0;
    check(VecRestoreArrayWrite(z, &to));
    check(VecRestoreArrayRead(r, &from));
  }

  void set_right_hand_side(const BandArray& r, Vec b) const { set(b, weight_ * r); }
  /// On all ranks.
  BandArray whole(Vec x) const {
    BandArray all(system_.size(), system_.bands());
    const double* from = nullptr;
    check(VecGetArrayRead(x, &from));
    for (const Index i : own_)
      for (Index b = 0; b < system_.bands(); ++b) all(i, b) = *from++;
    from -= own_size();
    check(VecRestoreArrayRead(x, &from));
    f_.ranks().gather(all);
    return all;
  }

 private:
  Index component(Index i) const { return system_.component()[static_cast<std::size_t>(i)]; }
  static BandArray over_ranks(BandArray sums) {
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM,
                  PETSC_COMM_WORLD);
    return sums;
  }
  void set(Vec y, const BandArray& values) const {
    double* to = nullptr;
    check(VecGetArrayWrite(y, &to));
    double* next = to;
    for (const Index i : own_)
      for (Index b = 0; b < system_.bands(); ++b) *next++ = values(i, b);
    check(VecRestoreArrayWrite(y, &to));
  }

  const RadiositySystem& system_;
  const DistributedFormFactors& f_;
  const BandArray& rho_;
  std::vector<Index> own_;
  BandArray reflects_, weight_, loss_, sink_, emitted_;
};

class PetscConjugateGradient final : public Solver {
 public:
  Index default_max_iterations(Index) const override { return 1000; }

 private:
  // What PETSc calls us with. It is written in C: what is thrown waits until it has returned.
  struct Context {
    const DeflatedSystem& system;
    const SolverOptions& options;
    State& state;
    const Step& step;
    const BandArray *w, *gamma;
    bool preconditioner_sees_residual = false;
    double share = 0;
    PetscInt steps = 0;  // of earlier rounds
    bool first = true, ended = false;
    std::exception_ptr thrown = {};

    template <class Work>
    PetscErrorCode guard(Work&& work) {
      try {
        work();
        return 0;
      } catch (...) {
        thrown = std::current_exception();
        return PETSC_ERR_LIB;
      }
    }
  };

  static PetscErrorCode multiply(Mat matrix, Vec x, Vec y) {
    void* context = nullptr;
    MatShellGetContext(matrix, &context);
    return static_cast<Context*>(context)->guard(
        [&] { static_cast<Context*>(context)->system.multiply(x, y); });
  }
  static PetscErrorCode precondition(PC pc, Vec r, Vec z) {
    void* context = nullptr;
    PCShellGetContext(pc, &context);
    auto& c = *static_cast<Context*>(context);
    return c.guard([&] {
      c.system.precondition(r, z);
      if (c.preconditioner_sees_residual) c.share = c.system.share_of(r);
    });
  }
  static PetscErrorCode test(KSP ksp, PetscInt iteration, PetscReal, KSPConvergedReason* reason,
                             void* context) {
    auto& c = *static_cast<Context*>(context);
    return c.guard([&] {
      *reason = KSP_CONVERGED_ITERATING;
      if (iteration == 0 && !c.first) return;  // told at the end of the round before
      if (!c.preconditioner_sees_residual) {
        Vec r = nullptr;
        check(KSPBuildResidual(ksp, nullptr, nullptr, &r));
        c.share = c.system.share_of(r);
        check(VecDestroy(&r));
      }
      if (c.steps + iteration > tolerance::kStepsWithoutDrift && c.share <= c.options.tolerance) {
        *reason = KSP_CONVERGED_RTOL;  // to be computed again
        return;
      }
      if (c.options.step) {
        Vec x = nullptr;
        check(KSPBuildSolution(ksp, nullptr, &x));
        const BandArray change = c.system.whole(x);
        c.state.radiosity = c.system.radiosity(*c.w + change, *c.gamma + c.system.change_of_gamma(change));
      }
      if (c.step(c.share)) return;
      c.ended = true;
      *reason = KSP_CONVERGED_RTOL;
    });
  }

  void iterate(const RadiositySystem& system, const SolverOptions& options, State& state,
               const Step& step) const override {
    const auto* const f = dynamic_cast<const DistributedFormFactors*>(&system.form_factors());
    if (f == nullptr) throw InputError("PETSc's solver takes form factors whose rows are shared by ranks");
    const DeflatedSystem deflated(system, *f);
    BandArray w = state.radiosity, gamma;
    Context context{deflated, options, state, step, &w, &gamma};

    Owned<Mat, MatDestroy> matrix;
    const PetscInt size = deflated.own_size();
    check(MatCreateShell(PETSC_COMM_WORLD, size, size, PETSC_DETERMINE, PETSC_DETERMINE, &context, &matrix));
    check(MatShellSetOperation(matrix, MATOP_MULT, reinterpret_cast<void (*)()>(&multiply)));
    check(MatSetOption(matrix, MAT_SYMMETRIC, PETSC_TRUE));
    Owned<Vec, VecDestroy> b, x;
    check(MatCreateVecs(matrix, &x, &b));
    Owned<KSP, KSPDestroy> ksp;
    check(KSPCreate(PETSC_COMM_WORLD, &ksp));
    check(KSPSetOperators(ksp, matrix, matrix));
    check(KSPSetType(ksp, KSPCG));
    PC pc = nullptr;
    check(KSPGetPC(ksp, &pc));
    check(PCSetType(pc, PCSHELL));
    check(PCShellSetContext(pc, &context));
    check(PCShellSetApply(pc, &precondition));
    check(PCShellSetName(pc, "diag(A/rho), even light of each component deflated"));
    const Index limit = options.max_iterations > 0 ? options.max_iterations : default_max_iterations(0);
    check(KSPSetTolerances(ksp, 1e-300, 1e-300, PETSC_DEFAULT, limit + 1));  // `step` ends it
    check(KSPSetConvergenceTest(ksp, &test, &context, nullptr));
    check(KSPSetComputeSingularValues(ksp, PETSC_TRUE));
    check(KSPSetFromOptions(ksp));
    KSPType type = nullptr;
    KSPNormType norm = KSP_NORM_NONE;
    PCType preconditioner = nullptr;
    check(KSPGetType(ksp, &type));
    const bool cg = type == std::string_view(KSPCG);
    PetscBool chosen = PETSC_FALSE;
    check(PetscOptionsHasName(nullptr, nullptr, "-ksp_norm_type", &chosen));
    if (cg && !chosen) check(KSPSetNormType(ksp, KSP_NORM_NATURAL));
    check(KSPGetNormType(ksp, &norm));
    check(PCGetType(pc, &preconditioner));
    context.preconditioner_sees_residual = cg && norm != KSP_NORM_NONE && norm != KSP_NORM_UNPRECONDITIONED &&
                                           preconditioner == std::string_view(PCSHELL);

    BandArray r = deflated.residual(w, gamma);
    double before = std::numeric_limits<double>::infinity();
    for (;;) {
      deflated.set_right_hand_side(r, b);
      const PetscErrorCode code = KSPSolve(ksp, b, x);
      if (context.thrown) std::rethrow_exception(context.thrown);
      check(code);
      PetscInt steps = 0;
      check(KSPGetIterationNumber(ksp, &steps));
      context.steps += steps;
      if (context.first && cg && system.bands() == 1 && system.components() == 1) {
        PetscReal largest = 1, least = 1;
        check(KSPComputeExtremeSingularValues(ksp, &largest, &least));
        if (steps > 0) {
          state.least[0] = std::min(state.least[0], least);
          state.largest[0] = std::max(state.largest[0], largest);
        }
      }
      context.first = false;
      w += deflated.whole(x);
      r = deflated.residual(w, gamma);
      state.radiosity = deflated.radiosity(w, gamma);
      KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
      check(KSPGetConvergedReason(ksp, &reason));
      if (context.ended || reason < 0) return;
      const double share = power_share(system, r);
      if (!step(share) || share > before / 2) return;
      before = share;
    }
  }
};

}  // namespace

// Where PETSc begins its database has options that it reads then, such as -log_view.
void begin_petsc(const std::string& options) {
  const char* const before = std::getenv("PETSC_OPTIONS");
  setenv("PETSC_OPTIONS", fmt::format("{} {}", before != nullptr ? before : "", options).c_str(), 1);
  check(PetscInitializeNoArguments());
  check(PetscPopSignalHandler());
  check(PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr));
}

void end_petsc() {
  PetscFinalize();
}

void add_petsc_options(const std::string& options) {
  check(PetscOptionsInsertString(nullptr, options.c_str()));
}

std::unique_ptr<Solver> petsc_conjugate_gradient() {
  return std::make_unique<PetscConjugateGradient>();
}

}  // namespace radiosity
