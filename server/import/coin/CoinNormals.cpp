#include "server/import/coin/CoinNormals.h"

#include <Inventor/VRMLnodes/SoVRMLIndexedFaceSet.h>
#include <Inventor/VRMLnodes/SoVRMLNormal.h>
#include <Inventor/elements/SoNormalBindingElement.h>
#include <Inventor/elements/SoNormalElement.h>
#include <Inventor/nodes/SoIndexedFaceSet.h>
#include <Inventor/nodes/SoIndexedTriangleStripSet.h>
#include <Inventor/nodes/SoNonIndexedShape.h>
#include <Inventor/nodes/SoVertexProperty.h>

#include <cstdint>

#include "server/import/coin/CoinNodes.h"
#include "server/import/reader/PlaceTable.h"

namespace tessera {
namespace {

/// What Coin does in some milliseconds: a shape may be used again and again.
constexpr double kMostPairs = 2e6;
/// Of fewer corners there are no more.
constexpr int kFew = 1400;

/// Pairs of faces that meet in one place, where these are very many; each corner is of so many faces.
class MeetingFaces {
public:
    explicit MeetingFaces(double each) : each_(each) {}
    void add(std::size_t place) {
        if (place >= faces_.size()) faces_.resize(place + 1);
        constexpr std::uint32_t kUsual = 64;
        if (++faces_[place] > kUsual) pairs_ += 2.0 * faces_[place] * each_ * each_;
    }
    [[nodiscard]] bool areTooMany() const { return pairs_ > kMostPairs; }

private:
    double each_, pairs_ = 0;
    std::vector<std::uint32_t> faces_;
};

bool areTooManyOf(const SoMFInt32& corners, double each) {
    if (corners.getNum() < kFew) return false;
    MeetingFaces faces(each);
    for (int i = 0; i < corners.getNum(); ++i)
        if (corners[i] >= 0) faces.add(static_cast<std::size_t>(corners[i]));
    return faces.areTooMany();
}

}  // namespace

PlainNormals::PlainNormals(SoNode& geometry) {
    if (!is<SoVRMLIndexedFaceSet>(geometry)) return;
    auto& set = static_cast<SoVRMLIndexedFaceSet&>(geometry);
    SoNode* const own = set.normal.getValue();
    const bool hasOwn = own != nullptr && is<SoVRMLNormal>(*own) && as<SoVRMLNormal>(*own).vector.getNum() > 0;
    if (hasOwn || !areTooManyOf(set.coordIndex, 1)) return;
    creaseAngle_ = set.creaseAngle.getValue();
    changed_ = &set;
    normal_ = own;
    if (normal_ != nullptr) normal_->ref();
    eachVertex_ = set.normalPerVertex.getValue() != FALSE;
    const int32_t* const numbers = set.normalIndex.getValues(0);
    index_.assign(numbers, numbers + set.normalIndex.getNum());
    auto* const one = new SoVRMLNormal;
    one->vector.setValue(SbVec3f(0, 1, 0));
    const std::vector<int32_t> zeros(static_cast<std::size_t>(set.coordIndex.getNum()), 0);
    set.normalPerVertex = FALSE;
    set.normalIndex.setValues(0, static_cast<int>(zeros.size()), zeros.data());
    set.normal = one;
}

PlainNormals::PlainNormals(SoNode& shape, const SoCallbackAction& action) {
    if (!is<SoVertexShape>(shape)) return;
    SoNode* const property = static_cast<SoVertexShape&>(shape).vertexProperty.getValue();
    const auto* const own =
        property != nullptr && is<SoVertexProperty>(*property) ? &as<SoVertexProperty>(*property) : nullptr;
    const bool hasNormals = action.getNumNormals() > 0 || (own != nullptr && own->normal.getNum() > 0);
    if (hasNormals) return;
    bool areTooMany = false;
    constexpr double kOfStrip = 3;
    if (is<SoIndexedFaceSet>(shape) || is<SoIndexedTriangleStripSet>(shape)) {
        areTooMany =
            areTooManyOf(static_cast<SoIndexedShape&>(shape).coordIndex, is<SoIndexedFaceSet>(shape) ? 1 : kOfStrip);
    } else if (is<SoNonIndexedShape>(shape)) {
        // These Coin compares by where they are.
        const bool ownPlaces = own != nullptr && own->vertex.getNum() > 0;
        const int points = ownPlaces ? own->vertex.getNum() : action.getNumCoordinates();
        PlaceTable places;
        MeetingFaces faces(kOfStrip);
        for (int i = 0; points >= kFew / kOfStrip && i < points; ++i) {
            const SbVec3f& place = ownPlaces ? own->vertex[i] : action.getCoordinate3(i);
            faces.add(places.numberOf(place.getValue()));
        }
        areTooMany = faces.areTooMany();
    }
    if (!areTooMany) return;
    creaseAngle_ = action.getCreaseAngle();
    static const SbVec3f kOne(0, 1, 0);
    SoNormalElement::set(action.getState(), &shape, 1, &kOne);
    SoNormalBindingElement::set(action.getState(), &shape, SoNormalBindingElement::OVERALL);
}

PlainNormals::~PlainNormals() {
    if (changed_ == nullptr) return;
    changed_->normal = normal_;
    if (normal_ != nullptr) normal_->unref();
    changed_->normalPerVertex = eachVertex_ ? TRUE : FALSE;
    changed_->normalIndex.setNum(static_cast<int>(index_.size()));
    changed_->normalIndex.setValues(0, static_cast<int>(index_.size()), index_.data());
}

}  // namespace tessera
