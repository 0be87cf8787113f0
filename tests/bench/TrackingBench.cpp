/// What the filter of tracked poses was chosen by: ways to smooth and predict, side by side, on heads that stand, walk,
/// sway, shake and stop. No clock and no wall: poses 60 times a second with noise, shown 33 ms after each. `--jitter
/// MM`.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <nlohmann/json.hpp>

#include "server/sim/tracking/PoseFilter.h"

namespace tessera::bench {
namespace {

constexpr double kStep = 1.0 / 60, kAhead = 0.033;

/// One way, one axis-free place at a time.
struct PlacePredictor {
    virtual ~PlacePredictor() = default;
    /// The place at `time` + kAhead.
    virtual Vec3d next(double time, const Vec3d& measured) = 0;
};

struct HoldPlace : PlacePredictor {
    Vec3d next(double, const Vec3d& measured) override { return measured; }
};

/// Casiez, Roussel, Vogel 2012, with its own derivative carried ahead.
struct OneEuroPlace : PlacePredictor {
    OneEuroPlace(double cutoff, double speed) : cutoff_(cutoff), beta_(speed) {}
    Vec3d next(double, const Vec3d& measured) override {
        if (!begun_) {
            begun_ = true;
            value_ = raw_ = measured;
        }
        const auto share = [](double hz) { return 1 / (1 + 1 / (2 * std::numbers::pi * hz * kStep)); };
        rate_ += share(1.0) * ((measured - raw_) / kStep - rate_);
        raw_ = measured;
        value_ += share(cutoff_ + beta_ * rate_.norm()) * (measured - value_);
        return value_ + kAhead * rate_;
    }
    double cutoff_, beta_;
    bool begun_ = false;
    Vec3d value_ = Vec3d::Zero(), raw_ = Vec3d::Zero(), rate_ = Vec3d::Zero();
};

/// LaViola 2003: smoothed twice, the line through both carried ahead.
struct DoubleExponentialPlace : PlacePredictor {
    explicit DoubleExponentialPlace(double share) : a_(share) {}
    Vec3d next(double, const Vec3d& measured) override {
        if (!begun_) {
            begun_ = true;
            once_ = twice_ = measured;
        }
        once_ += a_ * (measured - once_);
        twice_ += a_ * (once_ - twice_);
        const double steps = kAhead / kStep, slope = a_ * steps / (1 - a_);
        return (2 + slope) * once_ - (1 + slope) * twice_;
    }
    double a_;
    bool begun_ = false;
    Vec3d once_ = Vec3d::Zero(), twice_ = Vec3d::Zero();
};

/// Ours; with one acceleration for all motions it is the textbook's.
struct KalmanPlace : PlacePredictor {
    KalmanPlace(double jitter, double acceleration) : filter_(jitter, acceleration, acceleration) { filter_.restart(); }
    Vec3d next(double, const Vec3d& measured) override {
        if (!begun_) {
            begun_ = true;
            value_ = measured;
        }
        const Vec3d expected = value_ + kStep * filter_.rate();
        value_ = expected + filter_.correct(kStep, measured - expected);
        return value_ + kAhead * filter_.rate();
    }
    RateFilter filter_;
    bool begun_ = false;
    Vec3d value_ = Vec3d::Zero();
};

struct OurPlace : PlacePredictor {
    explicit OurPlace(double jitter)
        : filter_([&] {
              TrackerFilter settings;
              settings.jitterMillimetres = 1000 * jitter;
              return settings;
          }()) {}
    Vec3d next(double time, const Vec3d& measured) override {
        const TimePoint at = TimePoint{} + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * (100 + time)));
        (void)filter_.add(at, {.position = measured});
        return filter_.at(at + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * kAhead))).position;
    }
    PoseFilter filter_;
};

using Way = std::function<Vec3d(double)>;

Vec3d still(double) {
    return {0, 1.7, 2};
}
Vec3d walk(double t) {  // along, bobbing with each step
    return {0.8 * std::sin(0.9 * t), 1.7 + 0.025 * std::sin(2 * std::numbers::pi * 1.8 * t), 2};
}
Vec3d sway(double t) {
    return {0.3 * std::sin(2 * std::numbers::pi * 0.5 * t), 1.7, 2 + 0.1 * std::sin(2 * std::numbers::pi * 1.1 * t)};
}
Vec3d shake(double t) {
    return {0.08 * std::sin(2 * std::numbers::pi * 2.5 * t), 1.7, 2};
}
/// Every two seconds 0.6 m at up to 1.2 m/s, and stops within 0.15 s.
Vec3d stops(double t) {
    const double turn = std::floor(t / 2), s = t - 2 * turn, sign = std::fmod(turn, 2) == 0 ? 1 : -1;
    constexpr double kRise = 0.15, kCruise = 0.35, kSpeed = 1.2;
    const double top = kSpeed * (kRise + kCruise);
    double way = top;
    if (s < kRise)
        way = kSpeed * s * s / (2 * kRise);
    else if (s < kRise + kCruise)
        way = kSpeed * (s - kRise / 2);
    else if (s < 2 * kRise + kCruise)
        way = top - kSpeed * std::pow(2 * kRise + kCruise - s, 2) / (2 * kRise);
    return {(sign > 0 ? way : top - way), 1.7, 2};
}

struct PlaceErrors {
    double rms = 0, worst = 0, step = 0;  ///< from the truth at the instant shown; between two pictures
};
PlaceErrors judge(PlacePredictor& predictor, const Way& way, double jitter, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, jitter);
    double squares = 0, steps = 0;
    int count = 0;
    PlaceErrors errors;
    Vec3d before = Vec3d::Zero();
    for (int i = 0; i < 60 * 60; ++i) {
        const double t = i * kStep;
        const Vec3d shown = predictor.next(t, way(t) + Vec3d(noise(random), noise(random), noise(random)));
        const Vec3d off = shown - way(t + kAhead);
        if (i >= 120) {
            squares += off.squaredNorm();
            steps += (off - before).squaredNorm();
            errors.worst = std::max(errors.worst, off.norm());
            ++count;
        }
        before = off;
    }
    errors.rms = std::sqrt(squares / count);
    errors.step = std::sqrt(steps / count);
    return errors;
}

int bench(double jitter, const std::string& jsonPath) {
    struct Named {
        std::string name;
        std::function<std::unique_ptr<PlacePredictor>()> make;
    };
    std::vector<Named> ways = {{"as it comes", [] { return std::make_unique<HoldPlace>(); }}};
    for (const std::pair<double, double>& euro : {std::pair(1.0, 10.0), std::pair(2.0, 40.0)})
        ways.push_back({fmt::format("One Euro {:g} Hz, beta {:g}", euro.first, euro.second),
                        [=] { return std::make_unique<OneEuroPlace>(euro.first, euro.second); }});
    for (const double share : {0.3, 0.5, 0.7})
        ways.push_back({fmt::format("double exponential {:g}", share),
                        [=] { return std::make_unique<DoubleExponentialPlace>(share); }});
    for (const double acceleration : {0.5, 3.0, 15.0})
        ways.push_back({fmt::format("Kalman, {:g} m/s²", acceleration),
                        [=] { return std::make_unique<KalmanPlace>(jitter, acceleration); }});
    ways.push_back({"ours", [=] { return std::make_unique<OurPlace>(jitter); }});
    fmt::print("noise {:g} mm a direction; millimetres from where the head is when the picture is shown\n",
               1000 * jitter);
    fmt::print(
        "| way | at rest: rms | picture to picture | walking: rms | swaying: rms | shaking: rms | stops: rms | stops: "
        "worst |\n|---|---|---|---|---|---|---|---|\n");
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const Named& named : ways) {
        const auto run = [&](const Way& way) { return judge(*named.make(), way, jitter, 7); };
        const PlaceErrors rest = run(still), halts = run(stops);
        const double walking = run(walk).rms, swaying = run(sway).rms, shaking = run(shake).rms;
        fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} |\n", named.name,
                   1000 * rest.rms, 1000 * rest.step, 1000 * walking, 1000 * swaying, 1000 * shaking, 1000 * halts.rms,
                   1000 * halts.worst);
        rows.push_back({{"case", named.name},
                        {"rest_mm", 1000 * rest.rms},
                        {"step_mm", 1000 * rest.step},
                        {"walk_mm", 1000 * walking},
                        {"sway_mm", 1000 * swaying},
                        {"shake_mm", 1000 * shaking},
                        {"stops_mm", 1000 * halts.rms},
                        {"worst_mm", 1000 * halts.worst}});
    }
    if (jsonPath.empty()) return 0;
    std::ofstream file(jsonPath);
    file << nlohmann::ordered_json{{"cases", rows}}.dump(2) << "\n";
    return file ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    double jitter = 0.0005;
    std::string json;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--jitter") == 0) jitter = std::atof(argv[i + 1]) / 1000;
        if (std::strcmp(argv[i], "--json") == 0) json = argv[i + 1];
    }
    return tessera::bench::bench(jitter, json);
}
