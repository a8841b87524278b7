#include "tiles/store/position_model.h"

#include <algorithm>
#include <cmath>

namespace scarp {
namespace {

constexpr std::size_t kTerms = PositionModel::kTerms;
using Matrix = std::array<PositionModel::Terms, kTerms>;

/// Heights enter in units that make them about one.
constexpr double kHeightSteps = 0x1p22;  // 1024 m

/// Keeps the equations solvable where samples lie in a line; its weight against that of a sample.
constexpr double kRidge = 1e-9;

/// Rounds of fitting what the rounds before have left over, because one loses digits.
constexpr int kRounds = 3;

/// Factors a positive definite matrix into lower * transposed, in place.
void factor(Matrix& a) {
  for (std::size_t i = 0; i < kTerms; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(std::max(sum, kRidge)) : sum / a[j][j];
    }
  }
}

/// Solves lower * transposed * x = b.
PositionModel::Terms solve(const Matrix& lower, PositionModel::Terms x) {
  for (std::size_t i = 0; i < kTerms; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= lower[i][k] * x[k];
    x[i] /= lower[i][i];
  }
  for (std::size_t i = kTerms; i-- > 0;) {
    for (std::size_t k = i + 1; k < kTerms; ++k) x[i] -= lower[k][i] * x[k];
    x[i] /= lower[i][i];
  }
  return x;
}

}  // namespace

PositionModel::Terms PositionModel::basis(const Sample& sample) const {
  const double u = 2 * sample.column / last_column_ - 1, v = 2 * sample.row / last_row_ - 1;
  const double z = sample.height_steps / kHeightSteps;
  const double u2 = u * u, v2 = v * v, uv = u * v;
  return {1,       u,       v,       u2,      uv, v2,    u2 * u, u2 * v, uv * v, v2 * v, u2 * u2,
          u2 * uv, u2 * v2, uv * v2, v2 * v2, z,  z * u, z * v,  z * u2, z * uv, z * v2, z * z};
}

double PositionModel::value(const Sample& sample) const {
  const Terms of_sample = basis(sample);
  double sum = 0;
  for (std::size_t i = 0; i < kTerms; ++i) sum += terms_[i] * of_sample[i];
  return sum;
}

std::int64_t PositionModel::at(const Sample& sample) const {
  const double steps = value(sample);
  return std::abs(steps) < static_cast<double>(kMostSteps) ? std::llround(steps)
                                                           : 0;  // NaN, too, is 0
}

PositionModel PositionModel::fit(double last_column, double last_row,
                                 std::span<const Sample> samples) {
  PositionModel model(last_column, last_row, {});
  Matrix matrix{};
  for (std::size_t i = 0; i < kTerms; ++i) matrix[i][i] = kRidge;
  for (const Sample& sample : samples) {
    const Terms terms = model.basis(sample);
    for (std::size_t i = 0; i < kTerms; ++i)
      for (std::size_t j = 0; j <= i; ++j) matrix[i][j] += terms[i] * terms[j];
  }
  factor(matrix);
  for (int round = 0; round < kRounds; ++round) {
    Terms right{};
    for (const Sample& sample : samples) {
      const Terms terms = model.basis(sample);
      const double left_over = sample.value_steps - model.value(sample);
      for (std::size_t i = 0; i < kTerms; ++i) right[i] += terms[i] * left_over;
    }
    const Terms more = solve(matrix, right);
    for (std::size_t i = 0; i < kTerms; ++i) model.terms_[i] += more[i];
  }
  return model;
}

}  // namespace scarp
