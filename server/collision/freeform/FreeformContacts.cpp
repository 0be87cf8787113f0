#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/freeform/PartBounds.h"
#include "server/collision/freeform/PartChoice.h"

namespace tessera {
namespace {

/// Down all pairs that no direction parts, to parts of the spacing; then points of both that are within the tolerance,
/// or further down.
class ContactSearchOfParts {
public:
    ContactSearchOfParts(FreeformParts& a, FreeformParts& b, const PartBounds& bounds, double spacing,
                         const FreeformContactOptions& options, QueryWork& work)
        : a_(a),
          b_(b),
          bounds_(bounds),
          spacing_(spacing),
          tolerance_(std::max(options.tolerance, 4 * bounds.slack())),
          most_(options.most),
          work_(work) {}

    FreeformContacts run() {
        consider(a_.root(), b_.root(), std::nullopt);
        while (!open_.empty()) {
            if (work_.exhausted() || isFull_) {
                out_.complete = false;
                break;
            }
            const Open pair = open_.back();
            open_.pop_back();
            const bool divideA = dividesA(a_[pair.a], b_[pair.b], bounds_);
            FreeformParts& parts = divideA ? a_ : b_;
            const std::uint32_t which = divideA ? pair.a : pair.b;
            parts.divide(which);
            for (std::uint32_t c = 0; c < parts[which].children; ++c) {
                const std::uint32_t child = parts[which].firstChild + c;
                consider(divideA ? child : pair.a, divideA ? pair.b : child, pair.along);
            }
        }
        std::sort(out_.contacts.begin(), out_.contacts.end(), [](const FreeformContact& x, const FreeformContact& y) {
            return std::tie(x.a.face, x.b.face, x.a.u, x.a.v, x.b.u, x.b.v) <
                   std::tie(y.a.face, y.b.face, y.a.u, y.a.v, y.b.u, y.b.v);
        });
        return std::move(out_);
    }

private:
    struct Open {
        std::uint32_t a, b;
        Vec3d along;
    };

    void consider(std::uint32_t a, std::uint32_t b, const std::optional<Vec3d>& hint) {
        ++work_.boxTests;
        const FreeformPart &pa = a_[a], &pb = b_[b];
        const PartBounds::Gap gap = bounds_.gap(pa, pb, 0, hint);
        if (gap.length > 0) return;
        if (isFace(pa) && isFace(pb)) {
            const double reach = std::max(bounds_.radiusA(pa), bounds_.radiusB(pb));
            if (reach <= spacing_) {
                PlacePair at = bounds_.samples(a, b);
                const bool small = (pa.crossed || pb.crossed ? 16 : 4) * reach <= tolerance_ ||
                                   (a_.isSmallest(pa) && b_.isSmallest(pb));
                ++work_.triangleTests;
                if (!small) at = bounds_.descend(at, 0.01 * tolerance_, kSteps);
                if (small || (at.distance <= tolerance_ && bounds_.isThere(at))) {
                    add(at);
                    return;
                }
            }
        }
        open_.push_back({a, b, gap.along});
    }

    void add(const PlacePair& at) {
        std::array<std::int64_t, 3> cell{};
        const Vec3d middle = 0.5 * (at.onA + at.onB);
        for (std::size_t k = 0; k < 3; ++k) {
            const double place = middle[static_cast<Eigen::Index>(k)] / spacing_;
            cell[k] = static_cast<std::int64_t>(std::floor(std::clamp(place, -1e18, 1e18)));
        }
        if (!cells_.insert(cell).second) return;
        if (out_.contacts.size() >= most_) {
            isFull_ = true;
            return;
        }
        const Vec3d na = bounds_.normalA(at), nb = bounds_.normalB(at);
        FreeformContact contact;
        contact.a = placeOf(a_[at.a], at.inA, at.onA, na);
        contact.b = placeOf(b_[at.b], at.inB, at.onB, nb);
        contact.point = middle;
        contact.normal = contactNormal(na, nb, at.onB - at.onA);
        out_.contacts.push_back(contact);
    }

    static constexpr int kSteps = 12;

    FreeformParts &a_, &b_;
    const PartBounds& bounds_;
    double spacing_, tolerance_;
    std::size_t most_;
    QueryWork& work_;
    std::vector<Open> open_;
    std::set<std::array<std::int64_t, 3>> cells_;
    FreeformContacts out_;
    bool isFull_ = false;
};

}  // namespace

FreeformContacts FreeformPair::contacts(const Affine3d& a_T_b, QueryWork& work, const FreeformContactOptions& options) {
    const double reach = reachOf(a_, Affine3d::Identity()) + reachOf(b_, a_T_b);
    if (!std::isfinite(reach) || !std::isfinite(options.tolerance) || !std::isfinite(options.spacing))
        return {.contacts = {}, .complete = false};
    PartBounds bounds(partsA_, partsB_);
    bounds.place(Affine3d::Identity(), a_T_b, reach);
    const double size = std::min(a_.bounds().size().norm(), b_.bounds().transformed(a_T_b).size().norm());
    const double spacing = options.spacing > 0 ? options.spacing : size / 64;
    ContactSearchOfParts search(partsA_, partsB_, bounds, std::max({spacing, options.tolerance, 16 * bounds.slack()}),
                                options, work);
    return search.run();
}

}  // namespace tessera
