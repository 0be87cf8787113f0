#include "server/collision/pipeline/ContactList.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace tessera {
namespace {

/// Of a solid and what is inside it: no faces meet.
Contact contactWithin(const Part& a, const Part& b) {
    Contact contact;
    contact.faceA = contact.faceB = Contact::kNoFace;
    const bool bInside = b.worldBox.size().norm() <= a.worldBox.size().norm();
    contact.point = (bInside ? b : a).worldBox.center();
    const Vec3d apart = b.worldBox.center() - a.worldBox.center();
    contact.normal = apart.norm() > 0 ? Vec3d(apart.stableNormalized()) : Vec3d::UnitX();
    return contact;
}

/// Those of sleepers need not be worked out in each frame.
Contact contactOfHulls(const Part& a, const Part& b, const Touching& touching) {
    if (touching.known == nullptr) return contactOfHulls(a, b, touching.worldA, touching.worldB);
    HullContact& known = *touching.known;
    if (known.versionA != a.poseVersion || known.versionB != b.poseVersion) {
        const Contact contact = contactOfHulls(a, b, touching.worldA, touching.worldB);
        known = {a.poseVersion, b.poseVersion, contact.point, contact.normal};
    }
    Contact contact;
    contact.point = known.point;
    contact.normal = known.normal;
    contact.faceA = contact.faceB = Contact::kNoFace;
    return contact;
}

Contact contactAt(const ObjectHandler& handler, const Touching& touching, const FacePair* faces) {
    const Part& a = handler.parts()[touching.partA];
    const Part& b = handler.parts()[touching.partB];
    Contact contact = faces                            ? contactOfFaces(a, b, touching.worldA, touching.worldB, *faces)
                      : a.shape->hull && b.shape->hull ? contactOfHulls(a, b, touching)
                                                       : contactWithin(a, b);
    contact.objectA = touching.nodeA;
    contact.objectB = touching.nodeB;
    contact.interest = touching.interest;
    contact.time = touching.time;
    return contact;
}

}  // namespace

void ContactList::write(const ObjectHandler& handler, std::size_t most, StepResult& result,
                        std::vector<std::pair<ObjectId, ObjectId>>& nodes) {
    const auto key = [](const Touching& t) { return std::tie(t.nodeA, t.nodeB); };
    std::ranges::stable_sort(touching_, [&](const Touching& x, const Touching& y) { return key(x) < key(y); });
    std::vector<std::pair<FacePair, const Touching*>> faces;
    for (std::size_t begin = 0, end = 0; begin < touching_.size(); begin = end) {
        nodes.emplace_back(touching_[begin].nodeA, touching_[begin].nodeB);
        for (end = begin; end < touching_.size() && key(touching_[end]) == key(touching_[begin]);) ++end;
        if (result.contacts.size() >= most) {
            for (std::size_t i = begin; i < end; ++i) result.counters.contactsLeftOut += touching_[i].faceCount;
            continue;
        }
        // A pair can be hit by several movers in turn: the first account of two faces stays.
        faces.clear();
        for (std::size_t i = begin; i < end; ++i) {
            for (const FacePair& f : touching_[i].faces) faces.emplace_back(f, &touching_[i]);
            if (touching_[i].faces.empty())
                faces.emplace_back(FacePair{Contact::kNoFace, Contact::kNoFace}, &touching_[i]);
            result.counters.contactsLeftOut +=
                touching_[i].faceCount - std::max<std::uint64_t>(touching_[i].faces.size(), 1);
        }
        std::ranges::stable_sort(faces, {}, [](const auto& f) { return f.first; });
        const auto same = [](const auto& x, const auto& y) { return x.first == y.first; };
        faces.erase(std::unique(faces.begin(), faces.end(), same), faces.end());
        for (const auto& [pair, touching] : faces) {
            if (result.contacts.size() == most)
                ++result.counters.contactsLeftOut;
            else
                result.contacts.push_back(contactAt(handler, *touching, touching->faces.empty() ? nullptr : &pair));
        }
    }
    touching_.clear();
}

}  // namespace tessera
