#include "server/collision/response/Chain.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera {
namespace {

bool sameRotation(const Quatd& a, const Quatd& b) {
    return a.coeffs() == b.coeffs() || a.coeffs() == -b.coeffs();
}
bool turnsOrScales(const Way& way) {
    return way.start.scale != way.end.scale || !sameRotation(way.start.rotation, way.end.rotation);
}

/// m = scale · rotation, where it is that; a mirror's scale is negative.
struct Similarity {
    Quatd rotation = Quatd::Identity();
    double scale = 1;
};
std::optional<Similarity> asSimilarity(const Mat3d& m) {
    if (m == Mat3d::Identity()) return Similarity{};
    const double scale = std::cbrt(m.determinant());
    if (!std::isfinite(scale) || scale == 0) return std::nullopt;
    const Mat3d rotation = m / scale;
    // What a chain of a dozen rotations rounds to.
    constexpr double kRounding = 2e-14;
    if (!((rotation.transpose() * rotation - Mat3d::Identity()).cwiseAbs().maxCoeff() <= kRounding))
        return std::nullopt;
    return Similarity{Quatd(rotation).normalized(), scale};
}

}  // namespace

void Chain::append(const Way& way) {
    if (way.start.translation == way.end.translation && !turnsOrScales(way)) {
        append(localOf(way.start));
        return;
    }
    steps_.push_back({way, Affine3d::Identity()});
    moves_ = true;
}

void Chain::append(const Affine3d& fixed) {
    if (!steps_.empty() && !steps_.back().way)
        steps_.back().fixed = steps_.back().fixed * fixed;
    else
        steps_.push_back({std::nullopt, fixed});
}

Affine3d Chain::at(double fraction) const {
    Affine3d map = Affine3d::Identity();
    for (const Step& step : steps_) map = map * (step.way ? localOf(step.way->at(fraction)) : step.fixed);
    return map;
}

Reach Chain::reach(Reach below) const {
    for (auto step = steps_.rbegin(); step != steps_.rend(); ++step)
        below = step->way ? onWay(below, *step->way) : through(below, step->fixed);
    return below;
}

double Chain::stretch() const {
    double stretch = 1;
    for (const Step& step : steps_)
        stretch *=
            step.way ? std::max(step.way->start.scale.cwiseAbs().maxCoeff(), step.way->end.scale.cwiseAbs().maxCoeff())
                     : stretchOf(step.fixed.linear());
    return stretch;
}

Mat3d Chain::frameOfTurn() const {
    Mat3d linear = Mat3d::Identity();
    for (const Step& step : steps_) {
        if (step.way && turnsOrScales(*step.way)) return linear;
        linear = linear * (step.way ? localOf(step.way->start) : step.fixed).linear();
    }
    return Mat3d::Identity();
}

bool Chain::straight() const {
    return std::none_of(steps_.begin(), steps_.end(),
                        [](const Step& step) { return step.way && turnsOrScales(*step.way); });
}

std::optional<BodyMotion> Chain::asOneMotion(const Mat3d& frame) const {
    BodyMotion motion;
    Mat3d linear = frame;  // of what is above, while nothing has turned yet
    bool turned = false;
    Vec3d &from = motion.start.translation, &to = motion.end.translation;
    for (const Step& step : steps_) {
        if (!step.way && turned) {
            motion.body_T_mesh = motion.body_T_mesh * step.fixed;
        } else if (!step.way) {
            from += linear * step.fixed.translation();
            to += linear * step.fixed.translation();
            linear = linear * step.fixed.linear();
        } else if (turned) {
            return std::nullopt;
        } else {
            const Way& way = *step.way;
            from += linear * way.start.translation;
            to += linear * way.end.translation;
            if (!turnsOrScales(way)) {
                linear = linear * localOf(way.start).linear();
                continue;
            }
            const std::optional<Similarity> above = asSimilarity(linear);
            if (!above) return std::nullopt;
            turned = true;
            motion.start.rotation = above->rotation * way.start.rotation.normalized();
            motion.end.rotation = above->rotation * way.end.rotation.normalized();
            motion.start.scale = above->scale * way.start.scale;
            motion.end.scale = above->scale * way.end.scale;
        }
    }
    if (!turned) motion.body_T_mesh.linear() = linear;
    return motion;
}

BodyMotion Chain::asCarriedMotion() const {
    std::vector<BodyMotion> links;
    for (const Step& step : steps_) {
        if (step.way)
            links.push_back({.start = step.way->start, .end = step.way->end});
        else if (links.empty())
            links.push_back({.body_T_mesh = step.fixed});
        else
            links.back().body_T_mesh = links.back().body_T_mesh * step.fixed;
    }
    if (links.empty()) return {};
    BodyMotion motion = links.back();
    links.pop_back();
    motion.carriers = std::move(links);
    return motion;
}

ChainPair chainsOf(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, const WayLookup& wayOf) {
    const PagedRow<Place>& places = handler.places();
    const auto above = [&](std::uint32_t part) {
        std::vector<std::uint32_t> up;
        for (std::uint32_t at = handler.parts()[part].place; at != Place::kNone; at = places[at].frame())
            up.push_back(at);
        std::reverse(up.begin(), up.end());
        return up;
    };
    const std::vector<std::uint32_t> a = above(partA), b = above(partB);
    std::size_t common = 0;
    while (common < a.size() && common < b.size() && a[common] == b[common]) ++common;
    ChainPair pair;
    const auto append = [&](Chain& chain, std::uint32_t at) {
        const Place& place = places[at];
        if (!place.transform) return;
        if (const Way* way = wayOf(place.transform))
            chain.append(*way);
        else
            chain.append(place.local);
    };
    for (std::size_t i = 0; i < common; ++i) append(pair.shared, a[i]);
    for (std::size_t i = common; i < a.size(); ++i) append(pair.a, a[i]);
    for (std::size_t i = common; i < b.size(); ++i) append(pair.b, b[i]);
    return pair;
}

}  // namespace tessera
