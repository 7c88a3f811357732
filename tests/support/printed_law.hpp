// Eq. 5 as it is printed (with w^3), in 400 bits: about 120 digits, of which the cancellation near zeta = 1
// takes up to 45. The arguments are doubles taken as exact.
#pragma once

#include <mpfr.h>

#include <array>

namespace punctum {

class PrintedLaw {
 public:
  PrintedLaw() {
    for (auto& x : x_) {
      mpfr_init2(&x, 400);
    }
  }
  ~PrintedLaw() {
    for (auto& x : x_) {
      mpfr_clear(&x);
    }
  }
  PrintedLaw(const PrintedLaw&) = delete;
  PrintedLaw& operator=(const PrintedLaw&) = delete;

  // |value - F| / F.
  double relative_error(double value, double E_Pa, double nu, double h_m, double c_m, double wd_m,
                        double a_m) {
    auto* z2 = &x_[0];
    auto* log_z2 = &x_[1];
    auto* D = &x_[2];
    auto* N = &x_[3];
    auto* F = &x_[4];
    auto* t = &x_[5];
    mpfr_set_d(z2, c_m, kRound);
    mpfr_div_d(z2, z2, a_m, kRound);
    mpfr_sqr(z2, z2, kRound);
    mpfr_log(log_z2, z2, kRound);
    mpfr_ui_sub(t, 1, z2, kRound);
    mpfr_add(D, t, log_z2, kRound);  // D = 1 - z2 + ln z2
    mpfr_pow_ui(F, D, 3, kRound);
    mpfr_mul(F, F, t, kRound);  // (1 - z2) D^3
    mpfr_sub_ui(N, z2, 4, kRound);
    mpfr_mul(N, N, z2, kRound);
    mpfr_add_ui(N, N, 3, kRound);
    mpfr_mul_ui(t, log_z2, 2, kRound);
    mpfr_add(N, N, t, kRound);  // N = 3 - 4 z2 + z2^2 + 2 ln z2
    mpfr_div(F, N, F, kRound);
    mpfr_const_pi(t, kRound);
    mpfr_mul_ui(t, t, 2, kRound);
    for (const double factor : {E_Pa, h_m, wd_m, wd_m, wd_m}) {
      mpfr_mul_d(t, t, factor, kRound);
    }
    for (const double divisor : {a_m, a_m}) {
      mpfr_div_d(t, t, divisor, kRound);
    }
    mpfr_mul(F, F, t, kRound);
    mpfr_d_sub(t, 1, set(N, nu), kRound);
    mpfr_div(F, F, t, kRound);
    mpfr_d_sub(t, value, F, kRound);
    mpfr_div(t, t, F, kRound);
    mpfr_abs(t, t, kRound);
    return mpfr_get_d(t, kRound);
  }

 private:
  static constexpr mpfr_rnd_t kRound = MPFR_RNDN;
  static mpfr_ptr set(mpfr_ptr x, double value) {
    mpfr_set_d(x, value, kRound);
    return x;
  }
  std::array<__mpfr_struct, 6> x_{};
};

}  // namespace punctum
