#include "render/surface/microcylinder.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/adaptive_cubature.h"
#include "fibers/math/quadrature.h"
#include "fibers/math/spherical_gaussian.h"

namespace heddle {
namespace {

constexpr int kTangentLanes = 8;  // tangents computed at once
using Tangents = Lanes<kTangentLanes>;

// Panels of a ramp: eight Gauss-Legendre points on a panel of three deviations of a Gaussian leave
// 4e-9 of its peak.
constexpr double kPanelDeviations = 3;
constexpr double kWidestPanel = 0.35;  // radians; for everything else that varies

/// A direction in the frame of a thread that lies in the cloth: x along it, y across, z the cloth's
/// normal.
struct LocalDirection {
  LocalDirection(int direction, const Vec3d& w)
      : along(direction == 1 ? w.x() : w.y()),
        across(direction == 1 ? w.y() : -w.x()),
        up(w.z()),
        length(std::hypot(along, up)),
        psi(std::atan2(along, up)) {}

  /// In the frames of the thread's tangents at the given angles from the cloth.
  ThreadDirection<kTangentLanes> at(const Tangents& sine, const Tangents& cosine) const {
    return {along * cosine + up * sine, Tangents::Constant(across), up * cosine - along * sine};
  }

  double along, across, up;
  double length;  // of the projection on the plane of tangent and normal
  // angle from the normal in that plane, of a thread that lies flat; tilting the tangent by a adds
  // a
  double psi;
};

/// eq. 9 and 13: a product where two cosines are independent, the lesser one where both directions
/// are close.
template <typename Blend>
Tangents blended(const Blend& u, const Tangents& a, const Tangents& b) {
  return (1 - u) * a * b + u * a.min(b);
}

/// Means over a tangent curve.
struct CurveMeans {
  double surface = 0;    // <f_s's surface part * M P cos theta_i>
  double volume = 0;     // the same for the volume part, without the albedo
  double projected = 0;  // <P>
};

/// Panel ends, sorted and apart.
class Panels {
 public:
  Panels(double begin, double end) : begin_(begin), end_(end) { add(begin), add(end); }

  void add(double at) {
    if (!(at >= begin_ && at <= end_)) return;
    assert(count_ < kMost && "four graded ends of seven steps each way, and a dozen others");
    ends_[count_++] = at;
  }

  /// Ends about `centre` at distances reach, reach / 3, ... down to scale. For functions that vary
  /// over a distance that shrinks towards a point close to the integration path.
  void add_graded(double centre, double scale, double reach) {
    for (double distance = reach; distance > scale; distance /= 3)
      add(centre - distance), add(centre + distance);
  }

  template <typename Function>
  void for_each(Function&& f) {
    std::sort(ends_.begin(), ends_.begin() + count_);
    const double apart = 1e-4 * std::min(1.0, end_ - begin_);
    double from = begin_;
    for (std::size_t k = 1; k < count_; ++k) {
      const double to = ends_[k];
      if (k + 1 < count_ && (to - from < apart || end_ - to < apart)) continue;
      const int parts = static_cast<int>(std::ceil((to - from) / kWidestPanel));
      for (int part = 0; part < parts; ++part)
        f(from + (to - from) * part / parts, from + (to - from) * (part + 1) / parts);
      from = to;
    }
  }

 private:
  static constexpr std::size_t kMost = 120;
  double begin_, end_;
  std::array<double, kMost> ends_;
  std::size_t count_ = 0;
};

}  // namespace

struct Microcylinder::Thread {
  Thread(const MicrocylinderThread& thread, const ThreadConventions& conventions);

  CurveMeans means(const Vec3d& wi, const Vec3d& wo, int refinements) const;

  int direction;
  double share;
  ThreadScattering scattering;
  double blend_exponent;  // u(d) = exp(blend_exponent d^2)

  struct Batch {  // tangents at once; padded with weight 0
    Tangents angle, sine, cosine, weight;
  };
  std::vector<Batch> atoms;
  std::vector<TangentPiece> ramps;

  // Tangents that stand for the curve in sampling.
  std::vector<Batch> lobes;
  double surface_lobe = 0, volume_lobe = 0;  // standard deviations in theta_i
};

namespace {

template <typename Batch>
std::vector<Batch> batches_of(const std::vector<TangentPiece>& atoms) {
  std::vector<Batch> batches;
  for (std::size_t first = 0; first < atoms.size(); first += kTangentLanes) {
    Batch batch{Tangents::Zero(), Tangents::Zero(), Tangents::Ones(), Tangents::Zero()};
    for (std::size_t k = 0; k < kTangentLanes && first + k < atoms.size(); ++k) {
      const auto lane = static_cast<Eigen::Index>(k);
      batch.angle[lane] = atoms[first + k].begin;
      batch.sine[lane] = std::sin(atoms[first + k].begin);
      batch.cosine[lane] = std::cos(atoms[first + k].begin);
      batch.weight[lane] = atoms[first + k].share;
    }
    batches.push_back(batch);
  }
  return batches;
}

}  // namespace

Microcylinder::Thread::Thread(const MicrocylinderThread& thread,
                              const ThreadConventions& conventions)
    : direction(thread.direction),
      share(thread.share),
      scattering(thread.scattering, conventions),
      blend_exponent(-0.5 / (conventions.blend * conventions.blend)) {
  std::vector<TangentPiece> flat;
  for (const TangentPiece& piece : tangent_distribution(thread.offsets, thread.lengths)) {
    (piece.begin == piece.end ? flat : ramps).push_back(piece);
  }
  atoms = batches_of<Batch>(flat);

  // A tangent turned by d turns the mirror cone by 2 d; lobes 1.5 deviations apart add up to a
  // smooth one. At most about 32 of them: very narrow lobes are widened.
  double range = 0;
  for (const TangentPiece& ramp : ramps) range += ramp.end - ramp.begin;
  const double step = std::max(1.5 * scattering.surface_deviation(), range / 24);
  for (const TangentPiece& ramp : ramps) {
    const int count = static_cast<int>(std::ceil((ramp.end - ramp.begin) / step));
    for (int k = 0; k < count; ++k) {
      const double at = ramp.begin + (ramp.end - ramp.begin) * (k + 0.5) / count;
      flat.push_back({at, at, ramp.share / count});
    }
  }
  lobes = batches_of<Batch>(flat);
  // Wider than this a lobe is no better than uniform directions.
  constexpr double kWidestLobe = 0.6;
  surface_lobe = std::min(kWidestLobe, 2 * std::max(scattering.surface_deviation(), step / 1.5));
  volume_lobe = std::min(kWidestLobe, 2 * scattering.volume_deviation());
}

CurveMeans Microcylinder::Thread::means(const Vec3d& wi, const Vec3d& wo, int refinements) const {
  const LocalDirection in(direction, wi);
  const LocalDirection out(direction, wo);
  // both within 90 degrees of the normal, so wrapped already
  const double psi_d = in.psi - out.psi;
  const double u_psi = std::exp(blend_exponent * psi_d * psi_d);
  CurveMeans sum;
  const auto add = [&](const Tangents& sine, const Tangents& cosine, const Tangents& weight) {
    ThreadDirection<kTangentLanes> i = in.at(sine, cosine);
    ThreadDirection<kTangentLanes> r = out.at(sine, cosine);
    // M = P = 0 where either looks at the back of the local surface. Clamped there, so that 0 is
    // not multiplied by infinity.
    const auto facing = i.normal > 0 && r.normal > 0;
    Tangents w = facing.select(weight, 0.0);
    i.normal = i.normal.max(1e-60);
    r.normal = r.normal.max(1e-60);
    const ThreadAngles<kTangentLanes> angles = thread_angles<kTangentLanes>(i, r);
    w *= blended(u_psi, i.normal / in.length, r.normal / out.length);
    sum.projected += w.sum();
    const Tangents u_phi = (blend_exponent * angles.phi_d_squared).exp();
    w *= blended(u_phi, angles.cos_phi_i, angles.cos_phi_r) * angles.cos_theta_i;
    const ThreadValue<kTangentLanes> f = scattering.value<kTangentLanes>(angles);
    sum.surface += (w * f.surface).sum();
    sum.volume += (w * f.volume).sum();
  };
  for (const Batch& batch : atoms) add(batch.sine, batch.cosine, batch.weight);
  if (ramps.empty()) return sum;

  // Tangents that both directions see: -90 deg < psi + a < 90 deg.
  const double lowest = -kPi / 2 - std::min(in.psi, out.psi);
  const double highest = kPi / 2 - std::max(in.psi, out.psi);
  // Where the lesser of two cosines changes: in P, and in M.
  const double p_kink = -0.5 * (in.psi + out.psi);
  double m_kink = std::atan2(std::abs(out.across) * in.up - std::abs(in.across) * out.up,
                             std::abs(out.across) * in.along - std::abs(in.across) * out.along);
  if (m_kink <= lowest) m_kink += kPi;
  if (m_kink >= highest) m_kink -= kPi;
  // theta_h = 0, the middle of both Gaussians; theta_h changes at most as fast as the tangent's
  // angle.
  const double specular = -std::atan2(in.along + out.along, in.up + out.up);

  static const QuadratureRule& rule = gauss_legendre(kTangentLanes);
  static const Tangents nodes = Eigen::Map<const Tangents>(rule.nodes.data());
  static const Tangents weights = Eigen::Map<const Tangents>(rule.weights.data());
  for (const TangentPiece& ramp : ramps) {
    const double begin = std::max(ramp.begin, lowest);
    const double end = std::min(ramp.end, highest);
    if (!(end > begin)) continue;
    Panels panels(begin, end);
    panels.add(p_kink);
    panels.add(m_kink);
    panels.add(specular);
    for (const double deviation : {scattering.surface_deviation(), scattering.volume_deviation()}) {
      for (const double width : {1.0, 2.0}) {
        panels.add(specular - width * kPanelDeviations * deviation);
        panels.add(specular + width * kPanelDeviations * deviation);
      }
    }
    // phi turns from one side to the other where a tangent passes a direction at the distance asin
    // |across|.
    for (const LocalDirection& w : {in, out}) {
      const double distance = std::abs(w.across) / w.length;
      const double floor = 1e-3 * (highest - lowest);
      for (const double grazing : {-kPi / 2 - w.psi, kPi / 2 - w.psi}) {
        if (distance < kWidestPanel && distance > 0)
          panels.add_graded(grazing, std::max(distance, floor), 1.0);
      }
    }
    const double density = ramp.share / (ramp.end - ramp.begin);
    panels.for_each([&](double from, double to) {
      const int parts = 1 << refinements;
      for (int part = 0; part < parts; ++part) {
        // a = middle + 2 atan(tau) needs no sine or cosine per point.
        const double half = 0.5 * (to - from) / parts;
        const double middle = from + (2 * part + 1) * half;
        const double reach = std::tan(0.5 * half);
        const Tangents tau = reach * nodes;
        const Tangents scale = 1 / (1 + tau.square());
        const Tangents sine = 2 * tau * scale;
        const Tangents cosine = (1 - tau.square()) * scale;
        const double middle_sine = std::sin(middle);
        const double middle_cosine = std::cos(middle);
        add(middle_sine * cosine + middle_cosine * sine,
            middle_cosine * cosine - middle_sine * sine, (2 * reach * density) * weights * scale);
      }
    });
  }
  return sum;
}

/// min(1, (n . wi) / E(wi)) with E = integral over wo of R(wi, wo) (n . wo), in the largest
/// channel. E is directional albedo times n . wi, which stays finite towards the horizon. Bilinear
/// in a table over elevation and azimuth. Near the horizon E changes within a few degrees of a
/// thread's direction, where columns are close. On that direction itself it has a narrow minimum,
/// which no column may meet.
class Microcylinder::EnergyTable {
 public:
  explicit EnergyTable(const Microcylinder& fabric) : table_(kRows * kColumns) {
    tbb::parallel_for(0, kRows * kColumns, [&](int k) {
      const double elevation =
          std::max(1e-7, kPi / 2 * std::pow(static_cast<double>(k / kColumns) / (kRows - 1), 3));
      const double azimuth = azimuth_of(k % kColumns);
      const double level = std::cos(elevation);
      const Vec3d wi(level * std::cos(azimuth), level * std::sin(azimuth), std::sin(elevation));
      table_[static_cast<std::size_t>(k)] = fabric.directional_albedo(wi).maxCoeff() * wi.z();
    });
    // Within a degree of the horizon E is too rough to interpolate: the largest of each node and
    // its neighbours.
    const std::vector<double> rough = table_;
    for (int row = 0; row < kRoughRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        double most = 0;
        for (int r = std::max(0, row - 1); r <= row + 1; ++r) {
          for (int c = column - 1; c <= column + 1; ++c) {
            most = std::max(
                most, rough[static_cast<std::size_t>(r * kColumns + (c + kColumns) % kColumns)]);
          }
        }
        table_[static_cast<std::size_t>(row * kColumns + column)] = most;
      }
    }
  }

  double operator()(const Vec3d& wi) const {
    const double elevation = std::asin(std::min(1.0, wi.z()));
    const double row = std::clamp(std::cbrt(elevation / (kPi / 2)) * (kRows - 1), 0.0, kRows - 1.0);
    const double column = column_of(std::atan2(wi.y(), wi.x()));
    const int r = std::min(static_cast<int>(row), kRows - 2);
    const int c = static_cast<int>(std::floor(column));
    const auto at = [&](int i, int j) {
      return table_[static_cast<std::size_t>(i * kColumns + (j + kColumns) % kColumns)];
    };
    const double low = std::lerp(at(r, c), at(r, c + 1), column - c);
    const double high = std::lerp(at(r + 1, c), at(r + 1, c + 1), column - c);
    return std::min(1.0, kMargin * wi.z() / std::lerp(low, high, row - r));
  }

 private:
  static constexpr int kRows = 20;
  static constexpr int kRoughRows = 5;
  static constexpr int kColumns = 56;
  // what bilinear interpolation falls short by, and the cubature
  static constexpr double kMargin = 0.95;

  // Both coordinates are cubic: about the horizon, and about the four directions along threads with
  // seven columns to either side.
  static constexpr int kOctant = kColumns / 8;
  static double azimuth_of(int column) {
    const int axis = (column + kOctant) / (2 * kOctant);
    const double offset = (column - 2 * kOctant * axis + 0.5) / kOctant;
    return kPi / 2 * axis + kPi / 4 * offset * offset * offset;
  }
  static double column_of(double azimuth) {
    const double axis = std::round(azimuth / (kPi / 2));
    const double offset = azimuth - kPi / 2 * axis;
    return kOctant * (2 * axis + std::cbrt(offset / (kPi / 4))) - 0.5;
  }

  std::vector<double> table_;
};

Microcylinder::Microcylinder(const MicrocylinderFabric& fabric) {
  double covered = 0;
  for (const MicrocylinderThread& thread : fabric.threads) {
    threads_.emplace_back(thread, fabric.conventions);
    covered += thread.share;
  }
  gap_ = std::max(0.0, 1 - covered);
  if (fabric.energy_safe) energy_table_ = std::make_unique<EnergyTable>(*this);
}

Microcylinder::~Microcylinder() = default;

Rgbd Microcylinder::published(const Vec3d& wi, const Vec3d& wo, int refinements) const {
  if (!(wi.z() > 0 && wo.z() > 0)) return Rgbd::Zero();
  Rgbd sum = Rgbd::Zero();
  double visible = gap_ * wo.z();  // Q, eq. 15
  for (const Thread& thread : threads_) {
    const CurveMeans mean = thread.means(wi, wo, refinements);
    sum += thread.share * (mean.surface + thread.scattering.parameters().albedo * mean.volume);
    visible += thread.share * mean.projected;
  }
  return visible > 0 ? Rgbd(sum / visible) : Rgbd::Zero();
}

double Microcylinder::energy_scale(const Vec3d& wi) const {
  return energy_table_ && wi.z() > 0 ? (*energy_table_)(wi) : 1;
}

Rgbd Microcylinder::reflected(const SurfacePoint& /*point*/, const Vec3d& wi,
                              const Vec3d& wo) const {
  return published(wi, wo) * energy_scale(wi);
}

Rgbd Microcylinder::directional_albedo(const Vec3d& wi) const {
  CubatureSettings settings;
  settings.tolerance = 2e-3;
  settings.columns = 4;
  settings.rows = 8;
  const Rgbd flux =
      integrate_rectangle(0, kPi / 2, 0, 2 * kPi, settings, [&](double polar, double azimuth) {
        const double sine = std::sin(polar);
        const Vec3d wo(sine * std::cos(azimuth), sine * std::sin(azimuth), std::cos(polar));
        return Rgbd(reflected({}, wi, wo) * (sine * std::cos(polar)));
      });
  return flux / wi.z();
}

Rgbd Microcylinder::reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                                 const Vec3d& wo) const {
  // Polar coordinates about the axis. s^2 is the light's share nearer to the axis. At each distance
  // only the arc above the horizon is covered. Frame: `up` is the direction across the axis that
  // climbs most.
  const double sine = std::hypot(axis.x(), axis.y());
  const double elevation = std::atan2(axis.z(), sine);
  const Vec3d up = sine > 1e-12 ? Vec3d((Vec3d(0, 0, 1) - axis.z() * axis) / sine) : Vec3d(1, 0, 0);
  const Vec3d side = axis.cross(up);
  // s at a distance from the axis, radians.
  const auto place_of = [&](double distance) {
    const double depth = 2 * std::pow(std::sin(0.5 * std::clamp(distance, 0.0, kPi)), 2);
    return std::sqrt(sg_share_within(depth, sharpness));
  };
  CubatureSettings settings;
  settings.tolerance = 2e-3;
  // First cells of about 20 degrees or less, within three deviations of the light.
  const double reach = std::min(kPi, 3 / std::sqrt(std::max(sharpness, 1e-9)));
  settings.columns = std::clamp(static_cast<int>(std::ceil(reach / radians(20))), 2, 8);
  settings.rows = 2 * settings.columns;
  const auto integrate_between = [&](double from, double to) {
    if (!(place_of(to) > place_of(from))) return Rgbd(Rgbd::Zero());
    return integrate_rectangle(
        place_of(from), place_of(to), -1, 1, settings, [&](double s, double v) -> Rgbd {
          const double depth = sg_depth_of_share(s * s, sharpness);
          const double cosine = 1 - depth;
          const double radius = std::sqrt(depth * (2 - depth));
          // Half of the arc above the horizon.
          const double level = -axis.z() * cosine / std::max(sine * radius, 1e-300);
          const double arc = level <= -1 ? kPi : level >= 1 ? 0 : std::acos(level);
          if (arc == 0) return Rgbd::Zero();
          const Vec3d wi =
              cosine * axis + radius * (std::cos(arc * v) * up + std::sin(arc * v) * side);
          return reflected(point, wi, wo) * (s * arc / kPi);
        });
  };
  // The arc begins to be cut, or to exist, where the horizon is nearest, and is whole again, or
  // gone, where it is farthest.
  const double nearest = std::abs(elevation);
  return integrate_between(elevation > 0 ? 0 : nearest, elevation > 0 ? nearest : kPi - nearest) +
         integrate_between(elevation > 0 ? nearest : kPi - nearest,
                           elevation > 0 ? kPi - nearest : kPi);
}

/// The lobes of a batch of tangents for one wo: a Gaussian in theta_i about the mirror cone
/// -theta_o, cos phi_i / 2 in phi_i.
struct Microcylinder::Lobes {
  Lobes(const Thread& thread, const Thread::Batch& batch, const LocalDirection& wo) {
    const ThreadDirection<kTangentLanes> out = wo.at(batch.sine, batch.cosine);
    const ThreadParameters& parameters = thread.scattering.parameters();
    const Tangents normal = out.normal.max(0.0);
    const Tangents cos_theta = (normal.square() + out.binormal.square()).sqrt().max(1e-6);
    const Tangents cos_phi = normal / cos_theta;
    theta_o = inclination(out.tangent, cos_theta);
    // What each sends to wo, roughly: only noise depends on it. The square root of what is seen of
    // a tangent, because 1/Q makes up for it under light that few tangents meet.
    const Tangents seen = thread.share * batch.weight * (normal / wo.length).sqrt() * cos_phi;
    const Tangents reflected = fresnel_reflectance<kTangentLanes>(
        parameters.ior, cos_theta * (0.5 * (1 + cos_phi)).sqrt());
    const Tangents inside =
        seen * (1 - reflected).square() * (parameters.albedo.maxCoeff() / (0.5 + 0.5 * cos_theta));
    // The highest direction of the mirror cone, theta_i = -theta_o, stands this far above the
    // horizon.
    const Tangents height = kPi / 2 - (theta_o + batch.angle).abs();
    const auto above = [&](double deviation) -> Tangents {
      return 1 / (1 + (-1.7 / deviation * height).exp());
    };
    surface = 2 * seen * reflected;
    volume = (1 - parameters.kd) * inside;
    broad = parameters.kd * inside.sum() + 0.2 * (surface.sum() + volume.sum());
    surface *= above(thread.surface_lobe);
    volume *= above(thread.volume_lobe);
    total = surface.sum() + volume.sum();
  }

  static Tangents inclination(const Tangents& tangent, const Tangents& cos_theta) {
    return tangent.sign() * angle_of_half_tangent<kTangentLanes>(tangent.abs() / (1 + cos_theta));
  }

  /// Sum of all lobes' densities at wi (1/sr), each times what it sends.
  double density(const Thread& thread, const Thread::Batch& batch, const LocalDirection& wi) const {
    const ThreadDirection<kTangentLanes> in = wi.at(batch.sine, batch.cosine);
    const Tangents cos_theta_squared = (in.normal.square() + in.binormal.square()).max(1e-12);
    const Tangents from_cone = inclination(in.tangent, cos_theta_squared.sqrt()) + theta_o;
    const auto gaussian = [&](double deviation) -> Tangents {
      return (-0.5 / (deviation * deviation) * from_cone.square()).exp() /
             (std::sqrt(2 * kPi) * deviation);
    };
    const Tangents along =
        surface * gaussian(thread.surface_lobe) + volume * gaussian(thread.volume_lobe);
    return (along * in.normal.max(0.0) * 0.5 / cos_theta_squared).sum();
  }

  Tangents theta_o, surface, volume;
  double total;  // of all lobes
  double broad;  // what to give to uniform directions
};

double Microcylinder::density(const Vec3d& wi, const Vec3d& wo) const {
  if (!(wi.z() > 0 && wo.z() > 0)) return 0;
  double total = 0;
  double uniform = 0;
  double sum = 0;
  for (const Thread& thread : threads_) {
    const LocalDirection out(thread.direction, wo);
    const LocalDirection in(thread.direction, wi);
    for (const Thread::Batch& batch : thread.lobes) {
      const Lobes lobes(thread, batch, out);
      total += lobes.total;
      uniform += lobes.broad;
      sum += lobes.density(thread, batch, in);
    }
  }
  if (total + uniform == 0) uniform = 1;
  return (sum + uniform / (2 * kPi)) / (total + uniform);
}

float Microcylinder::pdf(const SurfacePoint& /*point*/, const Vec3& wi, const Vec3& wo) const {
  return static_cast<float>(density(wi.cast<double>(), wo.cast<double>()));
}

std::optional<SurfaceSample> Microcylinder::sample(const SurfacePoint& point, const Vec3& wo,
                                                   RandomStream& random) const {
  assert(wo.z() > 0 && "looked at from below");
  const Vec3d out_direction = wo.cast<double>();
  const double choice = random.uniform_double();
  const double a = random.uniform_double();
  const double b = random.uniform_double();
  const double c = random.uniform_double();
  double total = 0;
  double uniform = 0;
  for (const Thread& thread : threads_) {
    const LocalDirection out(thread.direction, out_direction);
    for (const Thread::Batch& batch : thread.lobes) {
      const Lobes lobes(thread, batch, out);
      total += lobes.total;
      uniform += lobes.broad;
    }
  }
  if (total + uniform == 0) uniform = 1;
  double left = choice * (total + uniform) - uniform;
  Vec3d wi(std::sqrt(1 - a * a) * std::cos(2 * kPi * b),
           std::sqrt(1 - a * a) * std::sin(2 * kPi * b), a);
  const auto draw = [&](const Thread& thread, const Thread::Batch& batch, const Lobes& lobes,
                        Eigen::Index k, double deviation) {
    const double theta =
        deviation * std::sqrt(-2 * std::log1p(-a)) * std::cos(2 * kPi * b) - lobes.theta_o[k];
    const double sin_phi = 2 * c - 1;
    const double normal = std::cos(theta) * std::sqrt(1 - sin_phi * sin_phi);
    const double along = std::sin(theta) * batch.cosine[k] - normal * batch.sine[k];
    const double across = std::cos(theta) * sin_phi;
    const double up = std::sin(theta) * batch.sine[k] + normal * batch.cosine[k];
    // Past a pole of the thread: not in the density.
    if (std::abs(theta) > kPi / 2) return Vec3d(0, 0, -1);
    return thread.direction == 1 ? Vec3d(along, across, up) : Vec3d(-across, along, up);
  };
  for (const Thread& thread : threads_) {
    if (left < 0) break;
    const LocalDirection out(thread.direction, out_direction);
    for (const Thread::Batch& batch : thread.lobes) {
      if (left < 0) break;
      const Lobes lobes(thread, batch, out);
      if (left >= lobes.total) {
        left -= lobes.total;
        continue;
      }
      for (Eigen::Index k = 0; k < kTangentLanes && left >= 0; ++k) {
        if (lobes.surface[k] + lobes.volume[k] == 0) continue;
        wi = draw(thread, batch, lobes, k,
                  left < lobes.surface[k] ? thread.surface_lobe : thread.volume_lobe);
        left -= lobes.surface[k] + lobes.volume[k];
      }
    }
  }
  const Vec3 drawn = wi.cast<float>();
  if (!(drawn.z() > 0)) return std::nullopt;
  const double p = density(wi, out_direction);
  const Rgbd value = reflected(point, wi, out_direction);
  return SurfaceSample{drawn, (value / p).cast<float>(), static_cast<float>(p)};
}

MicrocylinderFabric read_microcylinder_fabric(const TomlTable& document) {
  using Conventions = ThreadConventions;
  MicrocylinderFabric fabric;
  if (document.choice("gaussian_width", {"std", "iw"}, "std") == "iw")
    fabric.conventions.width = Conventions::Width::kIwasaki;
  if (document.choice("fresnel_angle", {"half", "normal"}, "half") == "normal") {
    fabric.conventions.fresnel = Conventions::Fresnel::kNormal;
  }
  fabric.conventions.blend = radians(document.number("blend_width_deg", {1, 90}, 20));
  fabric.energy_safe = document.boolean("energy_safe", false);
  constexpr std::size_t kMostThreads = 8;
  constexpr std::size_t kMostOffsets = 64;
  double covered = 0;
  for (const TomlTable& table : document.tables("thread")) {
    MicrocylinderThread thread;
    thread.direction = static_cast<int>(table.integer("direction", 1, 2));
    const std::array<double, 3> albedo = table.number3("albedo", {0, 1});
    thread.scattering.albedo = Rgbd(albedo[0], albedo[1], albedo[2]);
    thread.scattering.ior = table.number("ior", {1, 4});
    thread.scattering.kd = table.number("kd", {0, 1});
    thread.scattering.gamma_s = radians(table.number("gamma_s_deg", {0.1, 180}));
    thread.scattering.gamma_v = radians(table.number("gamma_v_deg", {0.1, 180}));
    thread.share = table.number("share", {0, 1});
    thread.offsets = table.numbers("offsets_deg", {-90, 90}, 2, kMostOffsets);
    for (double& offset : thread.offsets) offset = radians(offset);
    thread.lengths = table.numbers("lengths", {0, 1e6}, 1, kMostOffsets - 1);
    if (thread.lengths.size() + 1 != thread.offsets.size()) {
      table.fail("lengths", fmt::format("expected {} lengths between {} offsets, found {}",
                                        thread.offsets.size() - 1, thread.offsets.size(),
                                        thread.lengths.size()));
    }
    if (std::all_of(thread.lengths.begin(), thread.lengths.end(),
                    [](double length) { return length == 0; })) {
      table.fail("lengths", "expected a length above 0");
    }
    covered += thread.share;
    if (covered > 1 + 1e-9)
      table.fail("share", fmt::format("the shares of all threads sum to {}: at most 1", covered));
    fabric.threads.push_back(thread);
  }
  if (fabric.threads.empty() || fabric.threads.size() > kMostThreads) {
    document.fail("thread", fmt::format("expected 1 to {} tables [[thread]]", kMostThreads));
  }
  return fabric;
}

}  // namespace heddle
