#include "server/collision/spherical_bezier/SphericalBezierBound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "server/collision/spherical_bezier/SphericalPatch.h"

namespace tessera {

namespace {

/// Directions so near an edge (the sine of the angle) are taken to be on both sides: a thousand times what rounding
/// does.
constexpr double kInside = 1e-12;
/// Added to every lift, of the body's radius: what is left of rounding when forms and coefficients are multiplied out.
constexpr double kRounding = 1e-11;
constexpr std::uint32_t kSeveral = 0xffffffffU;

/// c, of a patch's six coefficients, as a matrix of b: p = b'cb.
Mat3d inCoordinates(const std::array<double, 6>& c) {
    Mat3d m;
    m << c[0], c[5], c[4], c[5], c[1], c[3], c[4], c[3], c[2];
    return m;
}

}  // namespace

SphericalBezierBound::SphericalBezierBound(const TriangleMesh& mesh, const SphericalBezierOptions& options)
    : mesh_(mesh),
      layout_(options.levels),
      centre_(options.centre.value_or(mesh.faceCount() > 0 ? mesh.bounds().center() : Vec3d::Zero())) {
    const std::size_t patches = layout_.triangles().size();
    corners_.resize(mesh_.vertexCount());
    patches_.resize(patches);
    onlyPatch_.resize(mesh_.faceCount(), kSeveral);
    needs_.resize(patches);
    largest_.resize(patches);
    fittedForms_.resize(patches);
    fittedNorms_.resize(patches);
    fittedLowest_.resize(patches);
    fitted_.resize(layout_.directions().size());
    lifted_.resize(layout_.directions().size());
    facesStart_.assign(mesh_.vertexCount() + 1, 0);
    for (const std::uint32_t v : mesh_.indices()) ++facesStart_[v + 1];
    std::partial_sum(facesStart_.begin(), facesStart_.end(), facesStart_.begin());
    faces_.resize(mesh_.indices().size());
    std::vector<std::uint32_t> next(facesStart_.begin(), facesStart_.end() - 1);
    for (std::uint32_t i = 0; i < mesh_.indices().size(); ++i) faces_[next[mesh_.indices()[i]]++] = i / 3;
    fit();
}

void SphericalBezierBound::fit() {
    fitCoefficients();
    follow();
}

void SphericalBezierBound::fitCoefficients() {
    // The radius in each of the layout's directions: that of the vertex whose direction is nearest, among all that are
    // used.
    std::vector<double> radius(fitted_.size(), 0), nearest(fitted_.size(), -2);
    std::vector<std::vector<std::uint32_t>> patchesOf(fitted_.size());
    for (std::uint32_t t = 0; t < layout_.points().size(); ++t)
        for (const std::uint32_t p : layout_.points()[t]) patchesOf[p].push_back(t);
    std::vector<std::vector<std::uint32_t>> vertices(patches_.size());
    std::vector<Vec3d> directions(mesh_.vertexCount());
    double sum = 0;
    std::size_t used = 0;
    for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) {
        if (facesStart_[v] == facesStart_[v + 1]) continue;
        const Vec3d offset = mesh_.positions()[v] - centre_;
        const double r = offset.norm();
        if (!(r > 0)) continue;
        directions[v] = offset / r;
        vertices[layout_.locate(offset).triangle].push_back(v);
        sum += r;
        ++used;
    }
    const double mean = used > 0 ? sum / static_cast<double>(used) : 0;
    for (std::size_t p = 0; p < radius.size(); ++p) {
        for (const std::uint32_t t : patchesOf[p])
            for (const std::uint32_t v : vertices[t]) {
                const double cosine = directions[v].dot(layout_.directions()[p]);
                if (cosine <= nearest[p]) continue;
                nearest[p] = cosine;
                radius[p] = (mesh_.positions()[v] - centre_).norm();
            }
        // Nothing of the body there.
        if (nearest[p] < -1) radius[p] = mean;
    }
    // p interpolates these. At a corner it is the coefficient; in the middle of an edge, b = (s, s, 0) with
    // s (v1 + v2) of length 1, it is s² (c1 + c2 + 2 c12). An edge's three numbers are the same from both sides.
    for (std::size_t t = 0; t < patches_.size(); ++t) {
        const auto& points = layout_.points()[t];
        const SphericalTriangle& domain = layout_.triangles()[t];
        for (std::size_t i = 0; i < 3; ++i) {
            fitted_[points[i]] = radius[points[i]];
            const std::size_t one = (i + 1) % 3, two = (i + 2) % 3;
            const double squares = (domain.corner(one) + domain.corner(two)).squaredNorm();
            fitted_[points[3 + i]] =
                0.5 * (radius[points[3 + i]] * squares - radius[points[one]] - radius[points[two]]);
        }
    }
    for (std::size_t t = 0; t < patches_.size(); ++t) {
        std::array<double, 6> c{};
        for (std::size_t i = 0; i < 6; ++i) c[i] = fitted_[layout_.points()[t][i]];
        const SphericalTriangle& domain = layout_.triangles()[t];
        fittedForms_[t] = domain.toCoordinates().transpose() * inCoordinates(c) * domain.toCoordinates();
        fittedNorms_[t] = fittedForms_[t].norm();
        const double least = *std::min_element(c.begin(), c.end());
        fittedLowest_[t] = std::min(least, least / (domain.height() * domain.height()));
    }
}

void SphericalBezierBound::place(std::size_t first, std::size_t count) {
    const MeshPositions positions = mesh_.positions();
    for (std::size_t v = first; v < first + count; ++v) {
        Corner& c = corners_[v];
        c.offset = positions[v] - centre_;
        c.radius = c.offset.norm();
        const SpherePlace place = layout_.locate(c.offset);
        c.patch = place.triangle;
        c.inside = place.margin > kInside;
        c.direction = c.radius > 0 ? Vec3d(c.offset / c.radius) : Vec3d::Zero();
        c.value = c.direction.dot(fittedForms_[c.patch] * c.direction);
        c.along = c.offset.dot(layout_.triangles()[c.patch].axis());
    }
}

template <typename Each>
void SphericalBezierBound::visit(std::uint32_t face, Each&& each) const {
    if (onlyPatch_[face] != kSeveral) {
        each(onlyPatch_[face]);
        return;
    }
    const Corner &a = corners_[mesh_.vertexOf(face, 0)], &b = corners_[mesh_.vertexOf(face, 1)],
                 &c = corners_[mesh_.vertexOf(face, 2)];
    if (a.inside && b.inside && c.inside)
        layout_.visit({a.offset, b.offset, c.offset}, {a.patch, b.patch, c.patch}, each);
    else
        layout_.visit({a.offset, b.offset, c.offset}, each);
}

void SphericalBezierBound::list(std::uint32_t face) {
    const Corner &a = corners_[mesh_.vertexOf(face, 0)], &b = corners_[mesh_.vertexOf(face, 1)],
                 &c = corners_[mesh_.vertexOf(face, 2)];
    const bool alone = a.patch == b.patch && b.patch == c.patch && a.inside && b.inside && c.inside;
    onlyPatch_[face] = alone ? a.patch : kSeveral;
    visit(face, [&](std::uint32_t patch) { patches_[patch].faces.push_back(face); });
}

void SphericalBezierBound::findLift(std::uint32_t patch) {
    PatchBound& bound = patches_[patch];
    const Vec3d& axis = layout_.triangles()[patch].axis();
    const Mat3d& form = fittedForms_[patch];
    double need = 0, largest = 0, nearest = std::numeric_limits<double>::infinity(), farthest = 0;
    for (const std::uint32_t face : bound.faces) {
        const std::array<const Corner*, 3> c{&corners_[mesh_.vertexOf(face, 0)], &corners_[mesh_.vertexOf(face, 1)],
                                             &corners_[mesh_.vertexOf(face, 2)]};
        const double radius = std::max({c[0]->radius, c[1]->radius, c[2]->radius});
        double least = 0;
        bool directed = true;
        if (onlyPatch_[face] != kSeveral) {
            const double spread = std::max({(c[0]->direction - c[1]->direction).squaredNorm(),
                                            (c[1]->direction - c[2]->direction).squaredNorm(),
                                            (c[2]->direction - c[0]->direction).squaredNorm()});
            least = std::min({c[0]->value, c[1]->value, c[2]->value}) - 0.5 * fittedNorms_[patch] * spread;
            nearest = std::min({nearest, c[0]->along, c[1]->along, c[2]->along});
            farthest = std::max({farthest, c[0]->along, c[1]->along, c[2]->along});
        } else {
            least = std::numeric_limits<double>::infinity();
            for (std::size_t i = 0; i < 3; ++i) {
                directed = directed && c[i]->radius > 0;
                const Vec3d product = form * c[i]->direction;
                for (std::size_t j = i; j < 3; ++j) least = std::min(least, product.dot(c[j]->direction));
                nearest = std::min(nearest, c[i]->offset.dot(axis));
                farthest = std::max(farthest, c[i]->offset.dot(axis));
            }
        }
        // A corner at the centre has no direction, and a negative bound is none where the coordinates sum to more
        // than 1.
        if (!directed || least < 0) least = fittedLowest_[patch];
        need = std::max(need, radius - least);
        largest = std::max(largest, radius);
    }
    needs_[patch] = bound.faces.empty() ? 0 : need + kRounding * (largest + fittedNorms_[patch]);
    bound.lift = needs_[patch];
    bound.nearest = std::max(0.0, nearest);
    bound.farthest = farthest;
    largest_[patch] = largest;
}

void SphericalBezierBound::lift() {
    // A common coefficient rises by the most that any of its patches asks for.
    std::fill(lifted_.begin(), lifted_.end(), 0.0);
    for (std::size_t t = 0; t < patches_.size(); ++t)
        for (const std::uint32_t p : layout_.points()[t]) lifted_[p] = std::max(lifted_[p], needs_[t]);
    for (std::uint32_t t = 0; t < patches_.size(); ++t) finish(t);
}

void SphericalBezierBound::finish(std::uint32_t patch) {
    PatchBound& bound = patches_[patch];
    if (bound.faces.empty()) return;
    const SphericalTriangle& domain = layout_.triangles()[patch];
    std::array<double, 6> c{};
    for (std::size_t i = 0; i < 6; ++i) c[i] = coefficient(layout_.points()[patch][i]);
    bound.form = domain.toCoordinates().transpose() * inCoordinates(c) * domain.toCoordinates();
    bound.formNorm = bound.form.norm();
    const double most = *std::max_element(c.begin(), c.end());
    bound.upper = std::min(largest_[patch], std::max(most, most / (domain.height() * domain.height())));
    // The cone between two planes across its axis: the ball whose centre is as far from both rims, or on the farther
    // plane where that would be beyond it. The cone's half-angle has the height as its cosine.
    const double tangent2 = std::max(0.0, 1 / (domain.height() * domain.height()) - 1);
    const double low = bound.nearest, high = std::max(low, std::min(bound.farthest, bound.upper));
    const double middle = std::min(0.5 * (low + high) * (1 + tangent2), high);
    bound.ballCentre = middle * domain.axis();
    const double rim = (high - middle) * (high - middle) + high * high * tangent2;
    bound.ballRadius = std::sqrt(std::max(rim, (middle - low) * (middle - low) + low * low * tangent2)) + 1e-9 * high;
}

void SphericalBezierBound::follow() {
    place(0, corners_.size());
    for (PatchBound& patch : patches_) patch.faces.clear();
    for (std::uint32_t face = 0; face < mesh_.faceCount(); ++face) list(face);
    for (std::uint32_t t = 0; t < patches_.size(); ++t) findLift(t);
    lift();
}

Expected<void> SphericalBezierBound::move(std::span<const Vec3d> positions) {
    if (Expected<void> moved = mesh_.move(positions); !moved) return moved;
    follow();
    return {};
}

Expected<void> SphericalBezierBound::move(std::size_t first, std::span<const Vec3d> positions) {
    if (Expected<void> moved = mesh_.move(first, positions); !moved) return moved;
    std::vector<std::uint32_t> faces(faces_.begin() + facesStart_[first],
                                     faces_.begin() + facesStart_[first + positions.size()]);
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    // Off the lists that they were on, as they were.
    std::vector<std::uint32_t> changed;
    const auto remember = [&](std::uint32_t patch) { changed.push_back(patch); };
    for (const std::uint32_t face : faces) visit(face, remember);
    const auto unique = [](std::vector<std::uint32_t>& v) {
        std::sort(v.begin(), v.end());
        v.erase(std::unique(v.begin(), v.end()), v.end());
    };
    unique(changed);
    for (const std::uint32_t patch : changed)
        std::erase_if(patches_[patch].faces,
                      [&](std::uint32_t face) { return std::binary_search(faces.begin(), faces.end(), face); });
    place(first, positions.size());
    for (const std::uint32_t face : faces) {
        list(face);
        visit(face, remember);
    }
    unique(changed);
    for (const std::uint32_t patch : changed) {
        std::sort(patches_[patch].faces.begin(), patches_[patch].faces.end());
        findLift(patch);
    }
    lift();
    return {};
}

std::size_t SphericalBezierBound::memoryBytes() const {
    std::size_t bytes = mesh_.memoryBytes() + corners_.capacity() * sizeof(Corner) +
                        patches_.capacity() * sizeof(PatchBound) +
                        (onlyPatch_.capacity() + facesStart_.capacity() + faces_.capacity()) * sizeof(std::uint32_t);
    for (const PatchBound& patch : patches_) bytes += patch.faces.capacity() * sizeof(std::uint32_t);
    return bytes;
}

double SphericalBezierBound::outerRadius(const Vec3d& direction) const {
    const SpherePlace place = layout_.locate(direction);
    const PatchBound& bound = patches_[place.triangle];
    if (bound.faces.empty()) return 0;
    const Vec3d u = direction.normalized();
    return std::min(bound.upper, u.dot(bound.form * u));
}

}  // namespace tessera
