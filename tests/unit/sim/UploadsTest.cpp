// Arrays that applications send in pieces: put together elsewhere, while the frame thread looks at no byte of them.
#include <gtest/gtest.h>

#include <sys/mman.h>
#include <unistd.h>
#include <csignal>

#include <atomic>
#include <cstring>
#include <thread>

#include "common/base/Channel.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/cores/ApplicationData.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/RequestDesk.h"
#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

Bytes someBytes(std::size_t size, std::uint64_t seed) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((i * 31 + seed * 7919) >> 2);
    return bytes;
}

/// Pages that nobody may read until somebody does: who that is, is counted.
class WatchedBytes {
public:
    explicit WatchedBytes(ByteSpan content)
        : size_(content.size()), mapped_((content.size() + kPage - 1) / kPage * kPage) {
        memory_ =
            static_cast<std::byte*>(mmap(nullptr, mapped_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
        std::memcpy(memory_, content.data(), size_);
        here_ = this;
        owner_ = gettid();
        mine_ = others_ = 0;
        struct sigaction action {};
        action.sa_sigaction = touched;
        action.sa_flags = SA_SIGINFO;
        sigaction(SIGSEGV, &action, &before_);
        mprotect(memory_, mapped_, PROT_NONE);
    }
    ~WatchedBytes() {
        sigaction(SIGSEGV, &before_, nullptr);
        munmap(memory_, mapped_);
        here_ = nullptr;
    }
    WatchedBytes(const WatchedBytes&) = delete;
    WatchedBytes& operator=(const WatchedBytes&) = delete;

    [[nodiscard]] ByteSpan bytes() const { return {memory_, size_}; }
    [[nodiscard]] ByteSlice slice(std::size_t at, std::size_t size) const {
        return {std::shared_ptr<const void>(memory_, [](const void*) {}), bytes().subspan(at, size)};
    }
    [[nodiscard]] std::size_t pages() const { return mapped_ / kPage; }
    /// Read first by the thread that made this, and by any other.
    [[nodiscard]] std::size_t touchedHere() const { return mine_; }
    [[nodiscard]] std::size_t touchedElsewhere() const { return others_; }

private:
    static constexpr std::size_t kPage = 4096;
    static void touched(int, siginfo_t* info, void*) {
        auto* at = static_cast<std::byte*>(info->si_addr);
        WatchedBytes* watched = here_;
        if (!watched || at < watched->memory_ || at >= watched->memory_ + watched->mapped_) {
            signal(SIGSEGV, SIG_DFL);  // a fault of its own: it comes again
            return;
        }
        ++(gettid() == owner_ ? mine_ : others_);
        mprotect(watched->memory_ +
                     (at - watched->memory_) / static_cast<std::ptrdiff_t>(kPage) * static_cast<std::ptrdiff_t>(kPage),
                 kPage, PROT_READ);
    }
    static inline WatchedBytes* here_ = nullptr;
    static inline pid_t owner_ = 0;
    static inline std::atomic<std::size_t> mine_{0}, others_{0};
    std::size_t size_, mapped_;
    std::byte* memory_ = nullptr;
    struct sigaction before_ {};
};

/// Its uploads are put together by a thread; what that has to say is taken here.
struct Uploading {
    explicit Uploading(const Uploads::Limits& limits = {})
        : uploads([this](UploadFinished one) { finished.push(std::move(one)); }, limits) {}
    /// All of a blob, in pieces.
    void send(ConnectionId connection, const BlobInfo& info, const ByteSlice& bytes, std::size_t pieceBytes) {
        message::Upload piece{.blobs = {info}, .bytes = {}};
        for (std::size_t at = 0; at == 0 || at < bytes.size(); at += pieceBytes) {
            piece.bytes = bytes.slice(bytes.bytes().subspan(at, std::min(pieceBytes, bytes.size() - at)));
            uploads.take(connection, std::exchange(piece, {}));
        }
    }
    void send(ConnectionId connection, const Blob& blob, std::size_t pieceBytes = 1000) {
        send(connection, {blob.id(), blob.sizeBytes()}, blob.slice(), pieceBytes);
    }
    /// What a proposal finds that comes now.
    Expected<std::vector<Blob>> end(ConnectionId connection) {
        const Expected<Uploads::Closed> closed = uploads.close(connection);
        if (!closed) return tl::unexpected(closed.error());
        if (closed->upload == 0) return std::vector<Blob>();
        std::optional<UploadFinished> one = finished.pop();
        if (!one || one->upload != closed->upload) return fail(ErrorCode::kFailed, "it does not end");
        uploads.handedOver(one->upload);
        return std::move(one->blobs);
    }
    Channel<UploadFinished> finished{64};
    Uploads uploads;  // last: its thread ends first
};

constexpr ConnectionId kOne{1}, kTwo{2};

TEST(Uploads, ComeTogetherFromPiecesOfAnySize) {
    forSeeds(50, [](Random& random) {
        Uploading desk;
        std::vector<Blob> blobs;
        Bytes stream;
        std::vector<std::size_t> begins;
        for (std::size_t i = 1 + below(random, 6); i > 0; --i) {
            const std::size_t size = oneIn(random, 5) ? 0 : below(random, oneIn(random, 2) ? 300 : 200'000);
            blobs.emplace_back(someBytes(size, random()));
            begins.push_back(stream.size());
            stream.insert(stream.end(), blobs.back().bytes().begin(), blobs.back().bytes().end());
        }
        const ByteSlice all = Bytes(stream);
        std::size_t said = 0;
        for (std::size_t at = 0; at < all.size() || said < blobs.size();) {
            const std::size_t size = std::min(all.size() - at, below(random, 100'000) + (oneIn(random, 3) ? 0 : 1));
            message::Upload piece{.blobs = {}, .bytes = all.slice(all.bytes().subspan(at, size))};
            at += size;
            while (said < blobs.size() && (begins[said] < at || begins[said] == all.size() || oneIn(random, 8))) {
                piece.blobs.push_back({blobs[said].id(), blobs[said].sizeBytes()});
                ++said;
            }
            desk.uploads.take(kOne, piece);
        }
        const Expected<std::vector<Blob>> whole = desk.end(kOne);
        ASSERT_TRUE(whole) << whole.error().message;
        ASSERT_EQ(whole->size(), blobs.size());
        for (std::size_t i = 0; i < blobs.size(); ++i) {
            EXPECT_EQ((*whole)[i], blobs[i]);
            EXPECT_TRUE(std::ranges::equal((*whole)[i].bytes(), blobs[i].bytes()));
        }
        EXPECT_TRUE(desk.end(kOne)->empty()) << "the next proposal has arrays of its own";
    });
}

TEST(Uploads, OfTwoApplicationsDoNotMix) {
    Uploading desk;
    const Blob first(someBytes(5000, 1)), second(someBytes(7000, 2));
    for (std::size_t at = 0; at < 7000; at += 1000) {
        for (const auto& [connection, blob] : {std::pair(kOne, first), std::pair(kTwo, second)}) {
            if (at >= blob.sizeBytes()) continue;
            message::Upload piece{.blobs = {}, .bytes = blob.slice().slice(blob.bytes().subspan(at, 1000))};
            if (at == 0) piece.blobs = {{blob.id(), blob.sizeBytes()}};
            desk.uploads.take(connection, piece);
        }
    }
    EXPECT_EQ(desk.end(kOne)->front(), first);
    EXPECT_EQ(desk.end(kTwo)->front(), second);
}

TEST(Uploads, ThatAreNotWhatTheySayAreRefusedInWords) {
    Uploading desk;
    const Blob blob(someBytes(5000, 1)), other(someBytes(5000, 2));
    const auto refused = [&] {
        const auto end = desk.end(kOne);
        ASSERT_FALSE(end);
        EXPECT_WORDS(end.error().message);
    };
    desk.send(kOne, {other.id(), 5000}, blob.slice(), 1000);
    refused();
    desk.send(kOne, {blob.id(), 6000}, blob.slice(), 1000);
    refused();
    desk.send(kOne, {blob.id(), 4000}, blob.slice(), 5000);
    refused();
    desk.uploads.take(kOne, {.blobs = {}, .bytes = blob.slice()});
    refused();
    desk.send(kOne, blob);
    desk.uploads.take(kOne, {.blobs = {}, .bytes = blob.slice()});
    refused();
    desk.send(kOne, blob);
    EXPECT_EQ(desk.end(kOne)->size(), 1u) << "the next one is sound";
}

TEST(Uploads, BeyondALimitAreRefusedAndTakeNoRoom) {
    const Blob blob(someBytes(5000, 1));
    Uploading desk({.maxBytes = 10'000, .maxBlobs = 3, .maxBytesOfAll = 15'000});
    for (int i = 0; i < 2; ++i) desk.send(kOne, blob);
    EXPECT_EQ(desk.end(kOne)->size(), 2u) << "at the limit";
    for (int i = 0; i < 2; ++i) desk.send(kOne, blob);
    desk.send(kOne, Blob(someBytes(1, 2)));
    EXPECT_EQ(desk.end(kOne).error().code, ErrorCode::kLimit) << "one above";
    desk.uploads.take(kOne, {.blobs = {{blob.id(), ~std::uint64_t{0}}}, .bytes = {}});
    EXPECT_EQ(desk.end(kOne).error().code, ErrorCode::kLimit);
    for (int i = 0; i < 4; ++i) desk.send(kOne, Blob(Bytes()));
    EXPECT_EQ(desk.end(kOne).error().code, ErrorCode::kLimit) << "many";
    for (int i = 0; i < 2; ++i) desk.send(kOne, blob);
    desk.send(kTwo, blob);
    desk.send(kTwo, Blob(someBytes(1, 2)));
    EXPECT_WORDS(desk.end(kTwo).error().message);
    desk.uploads.drop(kOne);
    // The thread throws it away before it comes to another's.
    constexpr ConnectionId kThree{3};
    desk.send(kThree, Blob(Bytes()));
    EXPECT_TRUE(desk.end(kThree));
    for (int i = 0; i < 2; ++i) desk.send(kTwo, blob);
    EXPECT_EQ(desk.end(kTwo)->size(), 2u) << "who has gone needs no room";
}

/// A desk for which no frame comes, and an application.
class UploadDesk : public testing::Test {
protected:
    explicit UploadDesk(const Uploads::Limits& of = {}) : limits(of) {}
    request::ProposeChanges naming(const Blob& blob) {
        test::ListMaker maker;
        const ObjectId data = maker.create<ApplicationData>();
        setField<&ApplicationData::data>(maker.builder, data, blob);
        maker.node("n", kRootNode, data);
        return {.list = share(encodeChangeList(maker.builder.take()))};
    }
    std::optional<std::string> ask(const ApplicationRequest& request) {
        server.forget();
        server.take(desk.received({application, "somebody", ++asked, share(encodeRequest(request))}, server.now));
        const auto replies = server.sent<message::Reply>(application);
        return replies.empty() ? std::nullopt : std::optional(replies[0].error);
    }

    const Uploads::Limits limits;
    Wall wall = test::wallOfOne();
    BlobStore blobs;
    ServerFixture server;
    Simulation simulation;
    ViewSource view{wall, ""};
    Loader loader{{}, {}, [](Preparation) {}};
    Uploading upload{limits};
    ManipulatorDrags drags;
    RequestDesk desk{{.wall = wall,
                      .blobs = blobs,
                      .session = server.session,
                      .simulation = simulation,
                      .view = view,
                      .loader = loader,
                      .uploads = &upload.uploads,
                      .drags = drags}};
    ConnectionId application = server.hello("somebody", PeerRole::kApplication);
    std::uint64_t asked = 0;
};

/// Counted in pages, by who reads each first.
TEST_F(UploadDesk, TheFrameThreadReadsNoByteOfWhatComes) {
    constexpr std::size_t kSize = std::size_t{16} << 20, kPiece = limits::kUploadPieceBytes;
    const Blob original(someBytes(kSize, 3));
    WatchedBytes watched(original.bytes());
    desk.applicationJoined(application);
    for (std::size_t at = 0; at < kSize; at += kPiece) {
        message::Upload piece{.blobs = {}, .bytes = watched.slice(at, std::min(kPiece, kSize - at))};
        if (at == 0) piece.blobs = {{original.id(), kSize}};
        server.forget();
        server.say(application, piece);
        for (const ServerAction& action : server.done)
            if (const auto* received = std::get_if<server_action::UploadReceived>(&action)) desk.uploading(*received);
    }
    EXPECT_FALSE(ask(naming(original)));
    EXPECT_TRUE(desk.takeEdits().empty()) << "it waits for its arrays";
    std::optional<UploadFinished> finished = upload.finished.pop();
    ASSERT_TRUE(finished);
    server.take(desk.uploaded(std::move(*finished), server.now));
    server.take(server.session.advance(server.now));
    for (const ServerAction& action : server.done)
        if (const auto* everywhere = std::get_if<server_action::BlobsEverywhere>(&action))
            server.take(desk.blobsEverywhere(everywhere->token));
    const std::vector<Edit> edits = desk.takeEdits();
    ASSERT_EQ(edits.size(), 1u);
    ASSERT_EQ(blobsOf(edits[0].list).size(), 1u);
    EXPECT_EQ(watched.touchedHere(), 0u);
    EXPECT_EQ(watched.touchedElsewhere(), watched.pages()) << "each is read once";
    const Blob there = blobsOf(edits[0].list)[0];
    ASSERT_EQ(there, original);
    EXPECT_TRUE(std::ranges::equal(there.bytes(), original.bytes()));
}

class FullUploadDesk : public UploadDesk {
protected:
    FullUploadDesk() : UploadDesk({.maxBytesOfAll = 15'000}) {}
};

/// A host that does not answer keeps proposals waiting; whoever made them may go and come again.
TEST_F(FullUploadDesk, ArraysOfProposalsThatWaitForHostsCountUntilTheirOutcome) {
    const ConnectionId host = server.join("a");
    server.ready(host, server.begin());
    ASSERT_EQ(server.state("a"), HostState::kLive);
    const auto everywhere = [&] {
        for (const auto& all : server.actions<server_action::BlobsEverywhere>())
            server.take(desk.blobsEverywhere(all.token));
        server.forget();
        return desk.takeEdits();
    };
    const auto uploadAndPropose = [&](ConnectionId from, std::uint64_t seed) -> std::string {
        const Blob blob(someBytes(6'000, seed));
        upload.send(from, blob);
        server.forget();
        server.take(desk.received({from, "somebody", ++asked, share(encodeRequest(naming(blob)))}, server.now));
        if (const auto replies = server.sent<message::Reply>(from); !replies.empty()) return replies[0].error;
        std::optional<UploadFinished> finished = upload.finished.pop();
        if (!finished) return "it does not end";
        server.take(desk.uploaded(std::move(*finished), server.now));
        return "";
    };
    for (std::uint64_t i = 0; i < 2; ++i) {
        const ConnectionId guest = server.hello("guest", PeerRole::kApplication);
        desk.applicationJoined(guest);
        ASSERT_EQ(uploadAndPropose(guest, i), "");
        EXPECT_TRUE(everywhere().empty()) << "the host has not got it";
        server.drop(guest);
        desk.applicationLeft(guest);
    }
    desk.applicationJoined(application);
    EXPECT_WORDS(uploadAndPropose(application, 7));
    // The host goes: nobody is waited for any more.
    server.forget();
    server.drop(host);
    const std::vector<Edit> edits = everywhere();
    ASSERT_EQ(edits.size(), 2u);
    FrameResult result;
    result.commit.sent = listAt(Sequence(6));
    for (const Edit& edit : edits) result.outcomes.push_back({.ticket = edit.ticket});
    (void)desk.committed(std::move(result), FrameNumber(1), {});
    EXPECT_EQ(uploadAndPropose(application, 8), "") << "what is in the scene needs no room here";
    EXPECT_EQ(everywhere().size(), 1u);
}

/// An array of 256 MiB takes 20 ms to be given back to the kernel.
TEST_F(UploadDesk, WhatTheHistoryForgetsIsFreedByTheOtherThread) {
    std::atomic<pid_t> freedBy{0};
    const Bytes bytes = someBytes(100'000, 9);
    FrameNumber number;
    const auto frame = [&](ChangeList list) {
        FrameResult result =
            simulation.step(number == FrameNumber(0), {Edit{.ticket = 1'000'000, .list = std::move(list)}});
        ASSERT_TRUE(result.outcomes.at(0).result) << result.outcomes[0].result.error().message;
        (void)desk.committed(std::move(result), number, {});
        number = number.next();
    };
    {
        const Blob watched(std::shared_ptr<const void>(bytes.data(), [&](const void*) { freedBy = gettid(); }), bytes);
        test::ListMaker maker;
        const ObjectId data = maker.create<ApplicationData>();
        setField<&ApplicationData::data>(maker.builder, data, watched);
        maker.node("n", kRootNode, data);
        ASSERT_NO_FATAL_FAILURE(frame(maker.builder.take()));
    }
    const std::vector<ObjectId> going{simulation.scene().root().children.front()};
    ASSERT_NO_FATAL_FAILURE(frame(removalOf(simulation.scene(), going)));
    // Its step is the oldest one day.
    for (int i = 0; i < 300; ++i) {
        EXPECT_EQ(freedBy.load(), i < 250 ? 0 : freedBy.load());
        test::ListMaker maker;
        maker.node("other", kRootNode);
        ASSERT_NO_FATAL_FAILURE(frame(maker.builder.take()));
    }
    for (const auto deadline = std::chrono::steady_clock::now() + 20s;
         freedBy == 0 && std::chrono::steady_clock::now() < deadline;)
        std::this_thread::yield();
    EXPECT_NE(freedBy.load(), 0) << "nobody has freed it";
    EXPECT_NE(freedBy.load(), gettid());
}

TEST_F(UploadDesk, ArraysBesideAListAreSmall) {
    desk.applicationJoined(application);
    const auto proposing = [&](std::size_t size) {
        const Blob blob(someBytes(size, 4));
        request::ProposeChanges proposal = naming(blob);
        proposal.blobs = {blob.slice()};
        return ask(proposal);
    };
    EXPECT_FALSE(proposing(limits::kMaxInlineArrayBytes));
    EXPECT_WORDS(proposing(limits::kMaxInlineArrayBytes + 1).value_or(""));
}

TEST_F(UploadDesk, WhatIsWrongWithArraysIsToldToWhoProposes) {
    desk.applicationJoined(application);
    const Blob blob(someBytes(5000, 1)), other(someBytes(5000, 2));
    upload.send(application, {other.id(), 5000}, blob.slice(), 1000);
    EXPECT_FALSE(ask(naming(other)));
    std::optional<UploadFinished> finished = upload.finished.pop();
    ASSERT_TRUE(finished);
    server.forget();
    server.take(desk.uploaded(std::move(*finished), server.now));
    const auto replies = server.sent<message::Reply>(application);
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_WORDS(replies[0].error);
    EXPECT_WORDS(ask(naming(blob)).value_or(""));  // what came with another one is not here
    // Too much is told at once.
    upload.uploads.take(application, {.blobs = {{blob.id(), limits::kMaxUploadBytes + 1}}, .bytes = {}});
    EXPECT_WORDS(ask(naming(blob)).value_or(""));
}

}  // namespace
}  // namespace tessera
