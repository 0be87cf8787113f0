/// The receiving half of what applications and the server say to each other. Not for other modules.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/ApplicationCodec.h"
#include "common/codec/ApplicationCollisionParts.h"
#include "common/codec/ApplicationSceneParts.h"
#include "common/codec/Unpacker.h"
#include "proto/application.pb.h"

namespace tessera {

/// With the values that several messages of applications hold, and their limits.
class ApplicationUnpacker : public Unpacker {
public:
    ApplicationUnpacker(const ByteSlice& whole, std::vector<ByteSpan> parts, const ApplicationLimits& limits)
        : Unpacker(whole, std::move(parts), limits.maxTextBytes), limits_(limits) {}

    [[nodiscard]] const ApplicationLimits& limits() const { return limits_; }

    template <typename Texts>
    std::vector<std::string> texts(const Texts& values, std::size_t most) {
        std::vector<std::string> out;
        if (!within(static_cast<std::size_t>(values.size()), most, "names")) return out;
        for (const std::string& value : values) out.push_back(text(value));
        return out;
    }
    double finite(double value) {
        if (!std::isfinite(value)) refuse(ErrorCode::kBadInput, "a number that is not finite");
        return value;
    }
    Vec3d vector(const proto::application::Vector& v) { return {finite(v.x()), finite(v.y()), finite(v.z())}; }
    Quatd rotation(const proto::application::Rotation& r) {
        const Quatd q(finite(r.w()), finite(r.x()), finite(r.y()), finite(r.z()));
        if (!tellsRotation(q.squaredNorm())) refuse(ErrorCode::kBadInput, "a quaternion that cannot be normalised");
        return q;
    }
    answer::Contacts contacts(const proto::application::Contacts& head) {
        expectCollision(1);
        return {FrameNumber(head.frame()), head.begun(), taken(unpackContacts(part(0), limits_.maxContacts)),
                head.left_out(), head.not_looked_at()};
    }
    answer::PairEvents events(const proto::application::PairEvents& head) {
        expectCollision(1);
        return {FrameNumber(head.frame()), taken(unpackEvents(part(0), limits_.maxEvents)), head.left_out()};
    }
    answer::Distances distances(const proto::application::Distances& head) {
        expectCollision(1);
        return {FrameNumber(head.frame()), taken(unpackDistances(part(0), limits_.maxDistances)), head.left_out()};
    }
    answer::Questions questions(const proto::application::Questions& head) {
        expectCollision(2);
        return {FrameNumber(head.frame()), taken(unpackQuestions(part(0), limits_.maxQuestions)),
                records<std::uint64_t>(1, limits_.maxQuestions), head.unanswered()};
    }

    ObjectType objectType(std::uint32_t number) {
        if (number > 0xffff) refuse(ErrorCode::kBadInput, "a type that cannot be");
        return ObjectType(static_cast<std::uint16_t>(number));
    }
    answer::Objects objects(const proto::application::Objects& head) {
        expectScene();
        return {Sequence(head.sequence()), taken(unpackObjects(part(0), part(1), limits_.maxNames)), bytes(2)};
    }
    answer::FoundPage foundPage(const proto::application::FoundPage& head) {
        expectScene();
        return {Sequence(head.sequence()), taken(unpackObjects(part(0), part(1), limits_.maxPageNodes)), records<ObjectId>(2, limits_.maxDepth),
                head.looked_at()};
    }
    answer::TreePage treePage(const proto::application::TreePage& head) {
        expectScene();
        answer::TreePage page{Sequence(head.sequence()), taken(unpackTree(part(0), limits_.maxPageNodes)), bytes(2),
                              records<ObjectId>(1, limits_.maxDepth)};
        if (within(static_cast<std::size_t>(head.lengths_size()), limits_.maxPageNodes, "lengths"))
            for (const auto& length : head.lengths()) page.lengths.push_back({ObjectId{length.core()}, finite(length.seconds())});
        return page;
    }

private:
    void expectScene() {
        expectParts(3);
        const bool fits = within(part(1).size(), limits_.maxSceneBytes, "bytes of paths") &&
                          within(part(2).size(), limits_.maxSceneBytes, "bytes of objects");
        if (!fits) dropParts();
    }
    /// Too many bytes are as good as none: nothing is taken of them.
    void expectCollision(std::size_t count) {
        expectParts(count);
        std::size_t bytes = 0;
        for (std::size_t i = 0; i < count; ++i) bytes += part(i).size();
        if (!within(bytes, limits_.maxCollisionBytes, "bytes of collisions")) dropParts();
    }

    const ApplicationLimits& limits_;
};

}  // namespace tessera
