/// The server's side of the protocol with a scene of its own, in the test's process, and with faults on demand.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <vector>

#include "common/codec/ApplicationCodec.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/WallCodec.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/net/TcpTransport.h"
#include "common/scene/Aspect.h"
#include "common/scene/Clones.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/SceneAnswers.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera::test {

inline Wall oneByOne() {
    Wall wall;
    wall.name = "1x1";
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = Vec3d(-1.6, 0.6, 0);
    screen.lowerRight = Vec3d(1.6, 0.6, 0);
    screen.upperLeft = Vec3d(-1.6, 2.4, 0);
    screen.grid.tileWidthPx = 96;
    screen.grid.tileHeightPx = 54;
    wall.screens = {screen};
    User user;
    user.name = "viewer";
    wall.users = {user};
    wall.hosts = {{"only", {{"front", 0, 0, Eye::kCenter, "viewer"}}}};
    return wall;
}

/// Ids of the scene that the scripted server begins with: /hall/crane/hook, the crane with a Transform.
inline constexpr ObjectId kHall{2}, kCrane{3}, kCraneCore{4}, kHook{5}, kHookCore{6}, kMetal{7};

inline ChangeList craneScene() {
    ChangeListBuilder edits;
    edits.create(kHall, typeOf<Node>());
    edits.create(kCrane, typeOf<Node>());
    edits.create(kCraneCore, typeOf<Transform>());
    edits.create(kHook, typeOf<Node>());
    edits.create(kHookCore, typeOf<Geometry>());
    edits.create(kMetal, typeOf<Material>());
    edits.place(kHall, kRootNode);
    edits.place(kCrane, kHall);
    edits.place(kHook, kCrane);
    edits.set(kHall, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("hall")));
    edits.set(kCrane, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("crane")));
    edits.set(kCrane, typeOf<Node>(), fieldId<&Node::core>, toValue(kCraneCore));
    edits.set(kHook, typeOf<Node>(), fieldId<&Node::name>, toValue(std::string("hook")));
    edits.set(kHook, typeOf<Node>(), fieldId<&Node::core>, toValue(kHookCore));
    edits.set(kHookCore, typeOf<Geometry>(), fieldId<&Geometry::material>, toValue(kMetal));
    edits.set(kCraneCore, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
    return edits.take();
}

class ScriptedServer {
public:
    ScriptedServer()
        : transport_(limits(), [this](LinkEvent event) { on(event); }),
          port_(transport_.listen({"127.0.0.1", 0}).value_or(0)) {
        const std::scoped_lock lock(mutex_);
        EXPECT_TRUE(scene_.apply(craneScene()));
        sequence_ = 1_seq;
    }

    [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

    /// Commits for everybody, as if another application had asked.
    void commit(const ChangeList& list) {
        const std::scoped_lock lock(mutex_);
        (void)commitLocked(list);
    }
    void notify(const ApplicationNotice& notice) {
        const std::scoped_lock lock(mutex_);
        for (const LinkId link : links_) say(link, message::Notice{share(encodeNotice(notice))});
    }
    void finish() {
        const std::scoped_lock lock(mutex_);
        for (const LinkId link : links_) say(link, message::Over{"the last frame was shown"});
    }
    void cutAll() {
        const std::scoped_lock lock(mutex_);
        for (const LinkId link : links_) transport_.close(link, "cut by the test");
    }
    /// Answers a request of the given kind; what is not scripted is refused. Edits, Undo and what asks for the scene
    /// work by themselves.
    void script(std::function<Expected<ApplicationAnswer>(const ApplicationRequest&)> answer) {
        const std::scoped_lock lock(mutex_);
        script_ = std::move(answer);
    }

    /// Of all that it was ever sent none is here any more.
    void forgetArrays() {
        const std::scoped_lock lock(mutex_);
        arraysGone_ = true;
    }

    /// From now on every commit says that these were kept from going where it wanted them.
    void stopEveryCommit(std::vector<ObjectId> transforms) {
        const std::scoped_lock lock(mutex_);
        stopped_ = std::move(transforms);
    }

    struct Faults {
        bool mute = false;            ///< never answers requests
        bool cutWhenAsked = false;    ///< closes the connection instead of answering
        bool endWhenLoading = false;  ///< closes it instead of loading a file, and from then on welcomes nobody
        bool noSnapshot = false;
        bool wrongHash = false;  ///< of lists
        bool malformed = false;  ///< sends rubbish in place of lists
        std::optional<message::Refused> refuse;
    };
    void misbehave(Faults faults) {
        const std::scoped_lock lock(mutex_);
        faults_ = std::move(faults);
    }
    [[nodiscard]] Subscription subscription() const {
        const std::scoped_lock lock(mutex_);
        return subscription_;
    }
    /// What has been uploaded: it is put together, or with `keep` false counted and thrown away.
    struct Uploaded {
        std::size_t pieces = 0, largestPiece = 0;
        std::uint64_t bytes = 0, claimed = 0;
    };
    [[nodiscard]] Uploaded uploaded() const {
        const std::scoped_lock lock(mutex_);
        return uploaded_;
    }
    void keepUploads(bool keep) {
        const std::scoped_lock lock(mutex_);
        keepUploads_ = keep;
    }
    void forgetSubscription() {
        const std::scoped_lock lock(mutex_);
        subscription_ = {};
    }
    [[nodiscard]] StateHash stateHash() const {
        const std::scoped_lock lock(mutex_);
        return scene_.stateHash();
    }

private:
    static TransportLimits limits() {
        TransportLimits limits;
        limits.maxPayload = maxPayloadBytesFromPeer;
        return limits;
    }
    void say(LinkId link, const Message& message) {
        transport_.send(link, wireType(message), 7_epoch, share(encodeMessage(message)));
    }

    void on(const LinkEvent& event) {
        const std::scoped_lock lock(mutex_);
        if (const auto* closed = std::get_if<link_event::Closed>(&event.what)) {
            std::erase(links_, closed->link);
            std::erase(followers_, closed->link);
        }
        const auto* received = std::get_if<link_event::Received>(&event.what);
        if (received == nullptr) return;
        const Expected<Message> message = decodeMessage(received->type, received->payload);
        ASSERT_TRUE(message) << message.error().message;
        if (const auto* hello = std::get_if<message::Hello>(&*message)) return greet(received->link, *hello);
        if (const auto* request = std::get_if<message::Request>(&*message)) return answer(received->link, *request);
        if (const auto* beat = std::get_if<message::Heartbeat>(&*message)) say(received->link, *beat);
        if (const auto* upload = std::get_if<message::Upload>(&*message)) take(*upload);
    }

    void take(const message::Upload& piece) {
        ++uploaded_.pieces;
        uploaded_.largestPiece = std::max(uploaded_.largestPiece, piece.bytes.size());
        uploaded_.bytes += piece.bytes.size();
        for (const BlobInfo& blob : piece.blobs) uploaded_.claimed += blob.sizeBytes;
        if (!keepUploads_) return;
        expected_.insert(expected_.end(), piece.blobs.begin(), piece.blobs.end());
        coming_.insert(coming_.end(), piece.bytes.begin(), piece.bytes.end());
        for (; !expected_.empty() && expected_.front().sizeBytes <= coming_.size(); expected_.pop_front()) {
            const auto end = coming_.begin() + static_cast<std::ptrdiff_t>(expected_.front().sizeBytes);
            whole_.push_back(store_.add(Blob(Bytes(coming_.begin(), end))));
            coming_.erase(coming_.begin(), end);
        }
    }

    void greet(LinkId link, const message::Hello& hello) {
        EXPECT_EQ(hello.role, PeerRole::kApplication);
        EXPECT_EQ(hello.schema, schemaHash());
        if (hasEnded_) return;
        if (faults_.refuse) {
            say(link, *faults_.refuse);
            return transport_.close(link, "refused");
        }
        links_.push_back(link);
        if (hello.follows) followers_.push_back(link);
        message::Welcome welcome;
        welcome.epoch = 7_epoch;
        welcome.configuration = share(encodeWall(oneByOne()));
        say(link, welcome);
        // As a server does: who has much to do is no silent one.
        const Message life = message::Heartbeat{};
        transport_.keepAlive(link, std::chrono::milliseconds(100), wireType(life), 7_epoch, share(encodeMessage(life)));
        if (hello.follows && !faults_.noSnapshot)
            say(link, message::Snapshot{
                          share(CommittedList{sequence_, scene_.stateHash(), encodeChangeList(snapshot(scene_)), {}})});
    }

    void answer(LinkId link, const message::Request& request) {
        if (faults_.mute) return;
        if (faults_.cutWhenAsked) return transport_.close(link, "cut by the test");
        const Expected<ApplicationRequest> asked = decodeRequest(request.body);
        ASSERT_TRUE(asked) << asked.error().message;
        if (faults_.endWhenLoading && std::holds_alternative<request::LoadFile>(*asked)) {
            hasEnded_ = true;
            return transport_.close(link, "ended by the test");
        }
        message::Reply reply;
        reply.id = request.id;
        const Expected<ApplicationAnswer> answer = answerTo(*asked);
        if (answer) {
            reply.body = share(encodeAnswer(*answer));
        } else {
            reply.code = answer.error().code;
            reply.error = answer.error().message;
        }
        say(link, reply);
    }

    Expected<ApplicationAnswer> answerTo(const ApplicationRequest& asked) {
        if (const auto* propose = std::get_if<request::ProposeChanges>(&asked)) {
            if (!keepUploads_) return fail(ErrorCode::kRefused, "the arrays were thrown away");
            std::vector<Blob> arrays = std::exchange(whole_, {});
            for (const ByteSlice& bytes : propose->blobs)
                arrays.push_back(store_.add(Blob(Bytes(bytes.begin(), bytes.end()))));
            BlobStore fresh;
            for (const Blob& array : arrays) (void)fresh.add(array);
            Expected<ChangeList> list = decodeChangeList(propose->list, arraysGone_ ? fresh : store_);
            if (list) arraysGone_ = false;
            if (!list) return tl::unexpected(list.error());
            return commitLocked(std::move(*list));
        }
        if (const auto* move = std::get_if<request::MoveNode>(&asked)) {
            Expected<ChangeList> list = moveList(scene_, move->node, move->move);
            if (!list) return tl::unexpected(list.error());
            return commitLocked(std::move(*list));
        }
        if (std::holds_alternative<request::UndoStep>(asked)) {
            if (inverses_.empty()) return fail(ErrorCode::kRefused, "there is nothing to undo");
            ChangeList inverse = std::move(inverses_.back());
            inverses_.pop_back();
            return commitLocked(std::move(inverse));
        }
        if (const auto* subscribe = std::get_if<request::SubscribeNews>(&asked)) {
            subscription_ = subscribe->wanted;
            return answer::Done{};
        }
        if (const auto* objects = std::get_if<request::GetObjects>(&asked)) return describe(scene_, objects->wish);
        if (const auto* tree = std::get_if<request::GetTree>(&asked))
            // Small pages: the little scene takes several.
            return treePage(scene_, tree->wish, {.maxTold = 2}).map([](answer::TreePage page) {
                return ApplicationAnswer(std::move(page));
            });
        if (const auto* find = std::get_if<request::FindNodes>(&asked))
            return foundPage(scene_, find->wish, {.maxLookedAt = 2}).map([](answer::FoundPage page) {
                return ApplicationAnswer(std::move(page));
            });
        if (const auto* clone = std::get_if<request::CloneNode>(&asked)) {
            Expected<Clone> made = cloneList(scene_, clone->wish.node,
                                             {.under = clone->wish.under,
                                              .name = clone->wish.name,
                                              .deep = clone->wish.deep,
                                              .shareTypes = clone->wish.shareTypes,
                                              .shareObjects = clone->wish.shareObjects});
            if (!made) return tl::unexpected(made.error());
            Expected<ApplicationAnswer> committed = commitLocked(std::move(made->list));
            if (!committed) return committed;
            answer::Committed& told = std::get<answer::Committed>(*committed);
            told.created = made->objects;
            std::erase_if(told.ids, [&](const auto& pair) { return pair.first != made->node; });
            return committed;
        }
        if (const auto* remove = std::get_if<request::RemoveNode>(&asked)) {
            Expected<ChangeList> list = removalList(scene_, remove->node);
            if (!list) return tl::unexpected(list.error());
            const std::size_t removed = list->destructions.size();
            Expected<ApplicationAnswer> committed = commitLocked(std::move(*list));
            if (committed) std::get<answer::Committed>(*committed).removed = removed;
            return committed;
        }
        if (script_) return script_(asked);
        return fail(ErrorCode::kRefused, "not scripted");
    }

    Expected<ApplicationAnswer> commitLocked(ChangeList list) {
        std::map<ObjectId, ObjectId> given;
        for (const Creation& creation : list.creations)
            if (isPlaceholder(creation.id)) given[creation.id] = ObjectId{nextId_++};
        replaceIds(list, [&](ObjectId id) { return given.contains(id) ? given[id] : id; });
        Expected<ChangeList> inverse = scene_.applyWithInverse(list);
        if (!inverse) return tl::unexpected(inverse.error());
        inverses_.push_back(std::move(*inverse));
        sequence_ = sequence_.next();
        Bytes bytes = encodeChangeList(list);
        if (faults_.malformed) bytes.assign(30, std::byte{0xff});
        for (const LinkId link : followers_)
            say(link,
                message::Changes{share(CommittedList{
                    sequence_, StateHash(scene_.stateHash().value + (faults_.wrongHash ? 1 : 0)), share(bytes), {}})});
        answer::Committed committed;
        committed.sequence = sequence_;
        committed.ids.assign(given.begin(), given.end());
        committed.stopped = stopped_;
        return committed;
    }

    mutable std::mutex mutex_;
    Aspect scene_;
    BlobStore store_;
    Sequence sequence_;
    std::uint64_t nextId_ = 100;
    std::vector<ChangeList> inverses_;
    std::vector<ObjectId> stopped_;
    std::vector<LinkId> links_, followers_;
    Faults faults_;
    bool hasEnded_ = false;
    Subscription subscription_;
    Uploaded uploaded_;
    bool keepUploads_ = true, arraysGone_ = false;
    std::deque<BlobInfo> expected_;
    Bytes coming_;
    std::vector<Blob> whole_;  ///< of the next proposal
    std::function<Expected<ApplicationAnswer>(const ApplicationRequest&)> script_;
    TcpTransport transport_;
    std::uint16_t port_;
};

}  // namespace tessera::test
