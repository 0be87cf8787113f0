#include "server/collision/pipeline/ContactList.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "server/collision/pairwise/Regions.h"

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
        known = {a.poseVersion, b.poseVersion, contact.point, contact.normal, contact.depth};
    }
    Contact contact;
    contact.point = known.point;
    contact.normal = known.normal;
    contact.depth = known.depth;
    contact.faceA = contact.faceB = Contact::kNoFace;
    return contact;
}

/// Of two closed surfaces all of whose contacts are known.
ContactRegions regionsOf(const ObjectHandler& handler, const Touching& touching) {
    if (touching.faces.empty() || !touching.allFaces) return {};
    const Part &a = handler.parts()[touching.partA], &b = handler.parts()[touching.partB];
    return regionsOf({*a.shape, touching.worldA}, {*b.shape, touching.worldB}, touching.faces);
}

Contact contactAt(const ObjectHandler& handler, const Touching& touching, const FacePair* faces,
                  const ContactRegions& regions) {
    const Part& a = handler.parts()[touching.partA];
    const Part& b = handler.parts()[touching.partB];
    const auto at =
        faces == nullptr
            ? 0
            : static_cast<std::size_t>(std::ranges::lower_bound(touching.faces, *faces) - touching.faces.begin());
    const bool placed = faces != nullptr && at < touching.places.size();
    Contact contact = placed  ? contactOfPlace(a, b, touching.worldA, touching.worldB, *faces, touching.places[at])
                      : faces ? contactOfFaces(a, b, touching.worldA, touching.worldB, *faces)
                      : a.shape->hull() && b.shape->hull() ? contactOfHulls(a, b, touching)
                                                           : contactWithin(a, b);
    if (faces != nullptr && !regions.regionOf.empty()) {
        const std::uint32_t number = regions.regionOf[at];
        if (number != ContactRegions::kNone && regions.regions[number].depth) {
            contact.normal = regions.regions[number].normal;
            contact.depth = *regions.regions[number].depth;
        }
    }
    contact.objectA = touching.nodeA;
    contact.objectB = touching.nodeB;
    contact.interest = touching.interest;
    contact.time = touching.time;
    return contact;
}

std::ptrdiff_t facesWanted(const PairState& pair, const Relation& relation) {
    const auto all = static_cast<std::ptrdiff_t>(pair.touch.faces.size());
    if (relation.detail == InterestWords::kAllFaces) return all;
    return std::min(all, relation.detail == InterestWords::kYesOrNo ? 1 : static_cast<std::ptrdiff_t>(relation.detail));
}

}  // namespace

std::uint64_t facesTold(const PairState& pair, const Relation& relation) {
    if (relation.detail == InterestWords::kAllFaces) return pair.touch.faceCount;
    return std::max<std::uint64_t>(static_cast<std::uint64_t>(facesWanted(pair, relation)), 1);
}

std::uint64_t facesListed(const PairState& pair, const Relation& relation) {
    return std::max<std::uint64_t>(static_cast<std::uint64_t>(facesWanted(pair, relation)), 1);
}

Touching restingContact(const ObjectHandler& handler, PairState& pair) {
    const Relation relation = handler.relation(std::min(pair.a, pair.b), std::max(pair.a, pair.b));
    Touching touching;
    touching.nodeA = pair.nodeA;
    touching.nodeB = pair.nodeB;
    touching.partA = pair.a;
    touching.partB = pair.b;
    touching.faces.assign(pair.touch.faces.begin(), pair.touch.faces.begin() + facesWanted(pair, relation));
    touching.faceCount = facesTold(pair, relation);
    touching.allFaces = pair.touch.all && pair.touch.faces.size() == pair.touch.faceCount && pair.touch.places.empty();
    if (!pair.touch.places.empty())
        touching.places.assign(pair.touch.places.begin(), pair.touch.places.begin() + facesWanted(pair, relation));
    touching.worldA = handler.parts()[pair.a].world;
    touching.worldB = handler.parts()[pair.b].world;
    touching.interest = handler.interests()[relation.interests.front()].core;
    touching.known = &pair.hullContact;
    return touching;
}

/// As far as it has not been noted since the list was last written.
void ContactList::noteBefore(const NodePair& key) {
    if (before_.contains(key)) return;
    before_.emplace(key, resting_.contains(key) || std::ranges::binary_search(addedBefore_, key));
}

void ContactList::rests(std::uint32_t pair, ObjectId nodeA, ObjectId nodeB, std::uint64_t faceCount,
                        std::uint64_t listed) {
    const NodePair key{nodeA, nodeB};
    if (restingOf_.size() <= pair) restingOf_.resize(pair + 1);
    Resting& resting = restingOf_[pair];
    if (resting.key != key) {
        noteBefore(key);
        resting_[key] = pair;
        resting.key = key;
    }
    faceCount_ += faceCount - resting.faceCount;
    resting.faceCount = faceCount;
    listed_ += listed - resting.listed;
    resting.listed = listed;
}

void ContactList::takeOut(std::uint32_t pair) {
    if (pair >= restingOf_.size() || !restingOf_[pair].key.first) return;
    const Resting resting = std::exchange(restingOf_[pair], {});
    noteBefore(resting.key);
    faceCount_ -= resting.faceCount;
    listed_ -= resting.listed;
    resting_.erase(resting.key);
}

void ContactList::takeOutAll() {
    for (const auto& [key, pair] : resting_) noteBefore(key);
    resting_.clear();
    restingOf_.clear();
    faceCount_ = listed_ = 0;
}

/// A pair can be hit by several movers in turn: the first account of two faces stays.
void ContactList::account(std::span<const Touching* const> all, Accounts& out) {
    out.clear();
    for (const Touching* touching : all) {
        for (const FacePair& f : touching->faces) out.emplace_back(f, touching);
        if (touching->faces.empty()) out.emplace_back(FacePair{Contact::kNoFace, Contact::kNoFace}, touching);
    }
    std::ranges::stable_sort(out, {}, [](const auto& f) { return f.first; });
    const auto same = [](const auto& x, const auto& y) { return x.first == y.first; };
    out.erase(std::unique(out.begin(), out.end(), same), out.end());
}

namespace {

std::pair<ObjectId, ObjectId> nodesOf(const Touching& t) {
    return {t.nodeA, t.nodeB};
}

/// Faces that it has beyond those that it names.
std::uint64_t unnamed(const Touching& t) {
    return t.faceCount - std::max<std::uint64_t>(t.faces.size(), 1);
}

}  // namespace

ContactList::Page ContactList::turnPage(const ObjectHandler& handler, const Describe& describe, std::size_t most) {
    if (std::exchange(pageTurned_, true)) touching_.clear();  // nothing was added
    std::ranges::stable_sort(touching_, [](const Touching& x, const Touching& y) { return nodesOf(x) < nodesOf(y); });
    std::vector<NodePair> added;
    for (const Touching& touching : touching_)
        if (added.empty() || added.back() != nodesOf(touching)) added.push_back(nodesOf(touching));
    Page page;
    for (const auto& [pair, touched] : before_) page.begun += !touched && resting_.contains(pair);
    for (const NodePair& pair : added)
        page.begun += !resting_.contains(pair) && !std::ranges::binary_search(addedBefore_, pair) &&
                      !(before_.contains(pair) && before_.at(pair));
    before_.clear();
    addedBefore_ = std::move(added);

    // How long the list is, without making it.
    std::uint64_t size = listed_;
    page.leftOut = faceCount_ - listed_;
    std::vector<const Touching*> accounts;
    Accounts faces;
    for (std::size_t next = 0; next < touching_.size();) {
        const NodePair pair = nodesOf(touching_[next]);
        Touching resting;
        accounts.clear();
        if (const auto rests = resting_.find(pair); rests != resting_.end()) {
            resting = describe(rests->second);
            size -= restingOf_[rests->second].listed;
            accounts.push_back(&resting);
        }
        for (; next < touching_.size() && nodesOf(touching_[next]) == pair; ++next) {
            page.leftOut += unnamed(touching_[next]);
            accounts.push_back(&touching_[next]);
        }
        account(accounts, faces);
        size += faces.size();
    }
    page.size = std::min<std::uint64_t>(size, most);
    if (size > most) {
        if (touching_.empty())
            page.leftOut = faceCount_ - most;
        else  // which accounts count twice depends on how far the list goes
            (void)list(handler, describe, most, page.leftOut);
    }
    return page;
}

std::vector<Contact> ContactList::list(const ObjectHandler& handler, const Describe& describe, std::size_t most,
                                       std::uint64_t& leftOut) const {
    std::vector<Contact> contacts;
    leftOut = 0;
    Accounts faces;
    std::vector<const Touching*> accounts;
    std::vector<std::pair<const Touching*, ContactRegions>> regions;  // of each account
    std::uint64_t notReached = faceCount_;
    auto rests = resting_.begin();
    std::size_t next = 0;
    while ((rests != resting_.end() || next < touching_.size()) && contacts.size() < most) {
        const NodePair pair = rests == resting_.end()    ? nodesOf(touching_[next])
                              : next == touching_.size() ? rests->first
                                                         : std::min(rests->first, nodesOf(touching_[next]));
        Touching resting;
        accounts.clear();
        if (rests != resting_.end() && rests->first == pair) {
            resting = describe(rests->second);
            notReached -= restingOf_[rests->second].faceCount;
            accounts.push_back(&resting);
            ++rests;
        }
        for (; next < touching_.size() && nodesOf(touching_[next]) == pair; ++next)
            accounts.push_back(&touching_[next]);
        for (const Touching* touching : accounts) leftOut += unnamed(*touching);
        account(accounts, faces);
        regions.clear();
        for (const Touching* touching : accounts) regions.emplace_back(touching, regionsOf(handler, *touching));
        for (const auto& [two, touching] : faces) {
            if (contacts.size() == most) {
                ++leftOut;
                continue;
            }
            const auto known = std::ranges::find(regions, touching, [](const auto& r) { return r.first; });
            contacts.push_back(contactAt(handler, *touching, touching->faces.empty() ? nullptr : &two, known->second));
        }
    }
    for (; next < touching_.size(); ++next) notReached += touching_[next].faceCount;
    leftOut += notReached;
    return contacts;
}

}  // namespace tessera
