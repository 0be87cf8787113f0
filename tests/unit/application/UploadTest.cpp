// What a proposal may bring: said by the library before anything is sent, and above a small array in pieces that are
// not copied.
#include <sys/mman.h>

#include "common/application/Application.h"
#include "common/cores/ApplicationData.h"
#include "tests/support/words/Words.h"
#include "tests/unit/Sanitized.h"
#include "tests/unit/application/ScriptedServer.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using test::ScriptedServer;

/// An array of zeroes that takes addresses and no memory.
Blob sparse(std::size_t size) {
    void* memory = mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    EXPECT_NE(memory, MAP_FAILED);
    (void)madvise(memory, size, MADV_HUGEPAGE);  // a million and a half faults else
    return {std::shared_ptr<const void>(memory, [size](const void* at) { munmap(const_cast<void*>(at), size); }),
            ByteSpan(static_cast<const std::byte*>(memory), size)};
}

std::unique_ptr<Application> join(ScriptedServer& server) {
    auto application =
        Application::connect({.address = server.address(), .name = "test", .followScene = false, .timeout = 60s});
    EXPECT_TRUE(application) << application.error().message;
    return application ? std::move(*application) : nullptr;
}

ChangeList naming(const std::vector<Blob>& blobs) {
    ChangeListBuilder edits;
    for (std::size_t i = 0; i < blobs.size(); ++i) {
        const ObjectId data{kFirstPlaceholder + i};
        edits.create(data, typeOf<ApplicationData>());
        setField<&ApplicationData::data>(edits, data, blobs[i]);
    }
    return edits.take();
}

Blob of(std::size_t size, unsigned seed) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((i * 131 + seed * 7919) >> 3);
    return Blob(std::move(bytes));
}

TEST(Uploading, SmallArraysGoWithTheListAndLargeOnesBeforeItInPieces) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    ASSERT_TRUE(application->propose(naming({of(1000, 1), of(limits::kMaxInlineArrayBytes - 1000, 2)})));
    EXPECT_EQ(server.uploaded().pieces, 0u);
    const std::size_t large = limits::kMaxInlineArrayBytes + 1;
    std::vector<Blob> blobs{of(large, 3), of(0, 4)};
    for (unsigned i = 0; i < 40; ++i) blobs.push_back(of(60'000, 10 + i));
    for (unsigned i = 0; i < 10; ++i) blobs.push_back(of(50'000 + 25'000 * i, 60 + i));
    ASSERT_TRUE(application->propose(naming(blobs)));
    const ScriptedServer::Uploaded uploaded = server.uploaded();
    EXPECT_EQ(uploaded.bytes, uploaded.claimed);
    EXPECT_GE(uploaded.bytes, large);
    EXPECT_LE(uploaded.largestPiece, limits::kUploadPieceBytes);
    EXPECT_LE(uploaded.pieces, 32u) << "several small ones in one";
    // What the server has taken is not sent again, as long as it has it.
    ASSERT_TRUE(application->propose(naming(blobs)));
    EXPECT_EQ(server.uploaded().bytes, uploaded.bytes);
    std::vector<Blob> others{of(large, 3), of(large, 5)};
    ASSERT_TRUE(application->propose(naming(others))) << "some of them known";
    EXPECT_EQ(server.uploaded().bytes, uploaded.bytes + large);
    server.forgetArrays();
    ASSERT_TRUE(application->propose(naming(others))) << "the server has let go of them";
    EXPECT_EQ(server.uploaded().bytes, uploaded.bytes + 3 * large);
    // Nobody here has the old ones any more: these come as if they were new.
    blobs.clear();
    blobs.push_back(of(large, 3));
    server.forgetArrays();
    ASSERT_TRUE(application->propose(naming(blobs)));
}

TEST(Uploading, UpToTheLimitIsSentAndOneAboveIsSaidBeforeAnythingIs) {
    if (kSanitized) GTEST_SKIP() << "a GiB of pages, looked at by a sanitizer";
    ScriptedServer server;
    server.keepUploads(false);
    const auto application = join(server);
    ASSERT_TRUE(application);
    for (const std::size_t above : {limits::kMaxUploadBytes + 1, (std::size_t{4} << 30) + 1}) {
        const auto refused = application->propose(naming({sparse(above)}));
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
        EXPECT_WORDS(refused.error().message);
        EXPECT_EQ(server.uploaded().pieces, 0u);
    }
    const auto sent = application->propose(naming({sparse(limits::kMaxUploadBytes)}));
    ASSERT_FALSE(sent);
    EXPECT_EQ(sent.error().message, "the arrays were thrown away") << "by the server: all of them were there";
    EXPECT_EQ(server.uploaded().bytes, limits::kMaxUploadBytes);
    EXPECT_TRUE(application->connected());
}

TEST(Uploading, OfSeveralArraysTheSumCounts) {
    if (kSanitized) GTEST_SKIP() << "a GiB of pages, looked at by a sanitizer";
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    const auto refused =
        application->propose(naming({sparse(limits::kMaxUploadBytes / 2), sparse(limits::kMaxUploadBytes / 2 + 1)}));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
    EXPECT_EQ(server.uploaded().pieces, 0u);
}

TEST(Uploading, AListThatIsTooLongIsSaidTooAndTheConnectionStays) {
    ScriptedServer server;
    const auto application = join(server);
    ASSERT_TRUE(application);
    ChangeListBuilder edits;
    const std::string name(4000, 'n');
    for (std::uint64_t i = 0; i * name.size() <= limits::kMaxProposalBytes; ++i)
        setField<&Node::name>(edits, ObjectId{1000 + i}, name);
    const auto refused = application->propose(edits.take());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
    EXPECT_WORDS(refused.error().message);
    const auto longName = application->load(std::string(limits::kMaxRequestBytes, 'f'));
    ASSERT_FALSE(longName);
    EXPECT_EQ(longName.error().code, ErrorCode::kLimit);
    EXPECT_TRUE(application->moveNode("/hall/crane", {.translation = Vec3d::Zero()})) << "nothing has been closed";
}

}  // namespace
}  // namespace tessera
