// Ceres on a joint job: automatic differentiation, one residual block per marker that a view sees and per length.
// Usage: ceres_joint JOB.bin markers|poses dense|sparse REPEAT; prints one line of JSON.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <vector>

struct Sight {
  const double* uv;  // four corners
  const double* corners;
  double sigma;
  template <typename T>
  bool operator()(const T* view, const T* eye, const T* marker, const T* lens, T* r) const {
    T back_view[3] = {-view[3], -view[4], -view[5]}, back_eye[3] = {-eye[3], -eye[4], -eye[5]};
    for (int c = 0; c < 4; ++c) {
      T p[3] = {T(corners[3 * c]), T(corners[3 * c + 1]), T(corners[3 * c + 2])}, w[3], q[3], k[3];
      ceres::AngleAxisRotatePoint(marker + 3, p, w);
      for (int i = 0; i < 3; ++i) w[i] += marker[i] - view[i];
      ceres::AngleAxisRotatePoint(back_view, w, q);
      for (int i = 0; i < 3; ++i) q[i] -= eye[i];
      ceres::AngleAxisRotatePoint(back_eye, q, k);
      T x = k[0] / k[2], y = k[1] / k[2], r2 = x * x + y * y, d = 1.0 + r2 * (lens[4] + r2 * lens[5]);
      T u = lens[0] * (x * d + 2.0 * lens[6] * x * y + lens[7] * (r2 + 2.0 * x * x)) + lens[2];
      T v = lens[1] * (y * d + lens[6] * (r2 + 2.0 * y * y) + 2.0 * lens[7] * x * y) + lens[3];
      r[2 * c] = (u - uv[2 * c]) / sigma;
      r[2 * c + 1] = (v - uv[2 * c + 1]) / sigma;
    }
    return true;
  }
};

struct Corner {  // one corner alone, for robust losses
  Sight sight;
  int c;
  template <typename T>
  bool operator()(const T* view, const T* eye, const T* marker, const T* lens, T* r) const {
    T all[8];
    sight(view, eye, marker, lens, all);
    r[0] = all[2 * c];
    r[1] = all[2 * c + 1];
    return true;
  }
};

struct Length {
  double value, sigma;
  const double* tip;
  template <typename T>
  bool operator()(const T* view, const T* cable, T* r) const {
    T p[3] = {T(tip[0]), T(tip[1]), T(tip[2])}, w[3];
    ceres::AngleAxisRotatePoint(view + 3, p, w);
    T s = T(0.0);
    for (int i = 0; i < 3; ++i) {
      T g = w[i] + view[i] - cable[i];
      s += g * g;
    }
    r[0] = (sqrt(s) - cable[3] - value) / sigma;
    return true;
  }
};

struct EyePrior {  // shift, and the rotation vector of the turn from where it was given
  const double *mean, *root;
  template <typename T>
  bool operator()(const T* eye, T* r) const {
    T a[4], b[4], c[4], m[3] = {T(-mean[3]), T(-mean[4]), T(-mean[5])}, e[6];
    ceres::AngleAxisToQuaternion(eye + 3, a);
    ceres::AngleAxisToQuaternion(m, b);
    ceres::QuaternionProduct(a, b, c);
    ceres::QuaternionToAngleAxis(c, e + 3);
    for (int i = 0; i < 3; ++i) e[i] = eye[i] - mean[i];
    for (int i = 0; i < 6; ++i) {
      r[i] = T(0.0);
      for (int j = 0; j < 6; ++j) r[i] += root[6 * i + j] * e[j];
    }
    return true;
  }
};

struct LensPrior {
  const double *mean, *sd;
  template <typename T>
  bool operator()(const T* lens, T* r) const {
    for (int i = 0; i < 8; ++i) r[i] = (lens[i] - mean[i]) / sd[i];
    return true;
  }
};

static std::vector<double> numbers(std::ifstream& in) {
  int64_t n = 0;
  in.read(reinterpret_cast<char*>(&n), 8);
  std::vector<double> out(n);
  in.read(reinterpret_cast<char*>(out.data()), 8 * n);
  return out;
}

static double busy() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double wall() {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  std::ifstream in(argv[1], std::ios::binary);
  const auto views0 = numbers(in), markers0 = numbers(in), eye0 = numbers(in), lens0 = numbers(in), cables0 = numbers(in);
  const auto tips = numbers(in), view = numbers(in), marker = numbers(in), uv = numbers(in), length = numbers(in);
  const auto corners = numbers(in), root = numbers(in), lens_sd = numbers(in), more = numbers(in);
  const double corner_sigma = more[0], length_sigma = more[1], tuning = more[2];
  const int kind = static_cast<int>(more[3]), repeat = std::atoi(argv[4]);
  const bool markers_first = !std::strcmp(argv[2], "markers"), dense = !std::strcmp(argv[3], "dense");
  std::vector<double> seconds, cpu;
  double cost = 0;
  int iterations = 0;
  for (int turn = 0; turn <= repeat; ++turn) {  // the first is not counted
    auto views = views0, markers = markers0, eye = eye0, lens = lens0, cables = cables0;
    ceres::Problem problem;
    auto loss = [&]() -> ceres::LossFunction* {
      if (kind == 1) return new ceres::HuberLoss(tuning);
      if (kind == 3) return new ceres::TukeyLoss(tuning);
      return nullptr;
    };
    for (size_t s = 0; s < view.size(); ++s) {
      double *v = &views[6 * size_t(view[s])], *m = &markers[6 * size_t(marker[s])];
      const Sight sight{&uv[8 * s], corners.data(), corner_sigma};
      if (kind == 0)
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Sight, 8, 6, 6, 6, 8>(new Sight(sight)), nullptr, v, eye.data(), m, lens.data());
      else
        for (int c = 0; c < 4; ++c)
          problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Corner, 2, 6, 6, 6, 8>(new Corner{sight, c}), loss(), v, eye.data(), m, lens.data());
    }
    for (size_t i = 0; i < length.size(); ++i)
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Length, 1, 6, 4>(new Length{length[i], length_sigma, &tips[3 * (i % 8)]}), loss(),
          &views[6 * (i / 8)], &cables[4 * (i % 8)]);
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<EyePrior, 6, 6>(new EyePrior{eye0.data(), root.data()}), nullptr, eye.data());
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<LensPrior, 8, 8>(new LensPrior{lens0.data(), lens_sd.data()}), nullptr, lens.data());
    if (problem.HasParameterBlock(&markers[0])) problem.SetParameterBlockConstant(&markers[0]);
    ceres::Solver::Options options;
    options.linear_solver_type = dense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.num_threads = 1;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-10;
    options.gradient_tolerance = options.parameter_tolerance = 1e-16;
    options.logging_type = ceres::SILENT;
    auto* order = new ceres::ParameterBlockOrdering;
    std::vector<double*> blocks;
    problem.GetParameterBlocks(&blocks);
    for (double* b : blocks) {
      const bool is_marker = b >= markers.data() && b < markers.data() + markers.size();
      const bool is_view = b >= views.data() && b < views.data() + views.size();
      order->AddElementToGroup(b, (markers_first ? is_marker : is_view) ? 0 : 1);
    }
    options.linear_solver_ordering.reset(order);
    ceres::Solver::Summary summary;
    const double from = wall(), used = busy();
    ceres::Solve(options, &problem, &summary);
    if (turn) {
      seconds.push_back(wall() - from);
      cpu.push_back(busy() - used);
    }
    cost = summary.final_cost;
    iterations = summary.num_successful_steps;
  }
  std::printf("{\"cost\": %.17g, \"iterations\": %d, \"version\": \"%s\"", cost, iterations, CERES_VERSION_STRING);
  for (int part = 0; part < 2; ++part) {
    std::printf(", \"%s\": [", part ? "cpu_seconds" : "seconds");
    const auto& list = part ? cpu : seconds;
    for (size_t i = 0; i < list.size(); ++i) std::printf("%s%.9g", i ? ", " : "", list[i]);
    std::printf("]");
  }
  std::printf("}\n");
  return 0;
}
