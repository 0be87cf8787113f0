// A large snapshot comes as a blob: fetched in parts, believed when it is what was announced, kept when a connection
// breaks.
#include "tests/unit/session/ClientFixture.h"

namespace tessera {
namespace {

/// A stand-in for the codec: such a blob is its list.
ClientSessionConfig opening(ClientSessionConfig config, std::vector<BlobInfo> named = {}) {
    config.openContent = [named](const Blob& blob) -> Expected<CommittedListPtr> {
        if (blob.sizeBytes() % 2 == 1) return fail(ErrorCode::kBadInput, "odd");
        return listAt(5_seq, named, blob.slice());
    };
    return config;
}

TEST(ClientSession, ALargeSnapshotIsFetchedAndThenWhatItNames) {
    const Blob scene(content(450, 1)), mesh(content(120, 2));
    ClientFixture c(opening(ClientFixture::named(), {infoOf(mesh)}));
    c.welcomed();
    c.bulkOpen();
    c.hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
    c.hear(message::Changes{listAt(6_seq, {}, textBytes("list"))});
    EXPECT_EQ(c.sent<message::BlobRequest>(ChannelKind::kBulk).size(), 2u);  // the window
    c.answerChunks({scene, mesh});
    ASSERT_EQ(c.actions<client_action::StoreBlob>().size(), 1u) << "the scene is no part of itself";
    EXPECT_EQ(c.actions<client_action::StoreBlob>()[0].blob, mesh);
    ASSERT_EQ(c.actions<client_action::ApplySnapshot>().size(), 1u);
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>()[0].snapshot.list->encoded, scene.slice());
    EXPECT_TRUE(c.actions<client_action::ApplyChanges>().empty());
    c.take(c.session.applied(5_seq, hashAfter(5_seq)));
    EXPECT_EQ(c.actions<client_action::ApplyChanges>().size(), 1u);
}

TEST(ClientSession, AnApplicationOpensItsBulkConnectionForALargeSnapshot) {
    const Blob scene(content(450, 1));
    ClientSessionConfig config = opening(ClientFixture::named());
    config.role = PeerRole::kApplication;
    config.wantBlobs = false;
    ClientFixture c(config);
    c.welcomed();
    EXPECT_TRUE(c.actions<client_action::OpenBulk>().empty());
    c.hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
    ASSERT_EQ(c.actions<client_action::OpenBulk>().size(), 1u);
    c.bulkOpen();
    c.answerChunks({scene});
    EXPECT_EQ(c.actions<client_action::ApplySnapshot>().size(), 1u);
}

TEST(ClientSession, ASnapshotThatIsNotTheAnnouncedOneOrMakesNoSenseEndsTheConnection) {
    for (const std::size_t size : {450u, 451u}) {
        const Blob scene(content(size, 1));
        ClientFixture c(opening(ClientFixture::named()));
        c.welcomed();
        c.bulkOpen();
        c.hear(message::Snapshot{listAt(size == 450u ? 6_seq : 5_seq), infoOf(scene)});
        c.answerChunks({scene});
        EXPECT_EQ(c.actions<client_action::Disconnect>().size(), 1u);
        EXPECT_TRUE(c.actions<client_action::ApplySnapshot>().empty());
    }
}

TEST(ClientSession, TheNextConnectionGoesOnWithWhatThisOneHadFetched) {
    const Blob scene(content(450, 1));
    ClientFixture first(opening(ClientFixture::named()));
    first.welcomed();
    first.bulkOpen();
    first.hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
    for (const std::uint64_t at : {0u, 100u})
        first.hear(message::BlobChunk{scene.id(), at, 450, scene.slice().slice(scene.bytes().subspan(at, 100))},
                   ChannelKind::kBulk);
    ClientFixture second(opening(ClientFixture::named()));
    second.session.resume(first.session.takeParts());
    second.welcomed();
    second.bulkOpen();
    second.hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
    ASSERT_FALSE(second.sent<message::BlobRequest>(ChannelKind::kBulk).empty());
    EXPECT_EQ(second.sent<message::BlobRequest>(ChannelKind::kBulk)[0].offset, 200u);
    second.answerChunks({scene});
    EXPECT_EQ(second.actions<client_action::ApplySnapshot>().size(), 1u);
}

}  // namespace
}  // namespace tessera
