// A link that comes and goes before the scene is there: what it has brought goes to the next connection, and what
// nobody wants any more goes.
#include "tests/property/Seeds.h"
#include "tests/unit/session/ClientFixture.h"

namespace tessera {
namespace {

constexpr std::size_t kBytes = 450;  ///< of each blob: five chunks

/// A link that breaks again and again; what one connection has fetched the next one is given.
class BadLink {
public:
    explicit BadLink(std::size_t maxUnwantedBytes = 0) {
        if (maxUnwantedBytes > 0) config_.maxUnwantedBytes = maxUnwantedBytes;
        config_.openContent = [this](const Blob& blob) -> Expected<CommittedListPtr> {
            return listAt(5_seq, named, blob.slice());
        };
    }
    ClientFixture& comes() {
        client_ = std::make_unique<ClientFixture>(config_);
        client_->session.resume(std::move(parts_));
        client_->welcomed();
        client_->bulkOpen();
        return *client_;
    }
    void goes() {
        parts_ = client_->session.takeParts();
        client_.reset();
    }
    [[nodiscard]] std::size_t keptBytes() const {
        std::size_t bytes = 0;
        for (const auto& [id, part] : parts_) bytes += part.end;
        return bytes;
    }
    [[nodiscard]] bool keeps(const Blob& blob) const { return parts_.contains(blob.id()); }
    /// So many chunks of a blob come.
    void chunks(const Blob& blob, std::uint64_t first, std::uint64_t count) {
        for (std::uint64_t at = 100 * first; count > 0; --count, at += 100)
            client_->hear(message::BlobChunk{blob.id(), at, blob.sizeBytes(),
                                             blob.slice().slice(blob.bytes().subspan(
                                                 at, std::min<std::size_t>(100, blob.sizeBytes() - at)))},
                          ChannelKind::kBulk);
    }
    std::vector<BlobInfo> named;  ///< by a scene that comes as a blob

private:
    ClientSessionConfig config_ = ClientFixture::named();
    std::unique_ptr<ClientFixture> client_;
    BlobFetcher::Parts parts_;
};

TEST(BlobParts, OfScenesThatOthersReplacedAreGivenBack) {
    BadLink link;
    for (unsigned i = 1; i <= 50; ++i) {
        const Blob scene(content(kBytes, i));  // it has changed since
        link.comes().hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
        link.chunks(scene, 0, 2);
        link.goes();
        EXPECT_TRUE(link.keeps(scene));
        ASSERT_LE(link.keptBytes(), kBytes) << "after " << i << " connections";
    }
}

TEST(BlobParts, OfArraysThatTheSceneNamesNoLongerAreGivenBack) {
    for (const bool sceneIsBlob : {false, true}) {
        BadLink link;
        for (unsigned i = 1; i <= 50; ++i) {
            const Blob scene(content(kBytes, 1000 + i)), array(content(kBytes, i));
            link.named = {infoOf(array)};
            if (sceneIsBlob) {
                link.comes().hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
                link.chunks(scene, 0, 5);
            } else {
                link.comes().hear(message::Snapshot{listAt(5_seq, link.named)});
            }
            link.chunks(array, 0, 2);
            link.goes();
            EXPECT_TRUE(link.keeps(array));
            ASSERT_LE(link.keptBytes(), kBytes) << "after " << i << " connections";
        }
    }
}

/// Where the scene never comes nobody knows what is still wanted: a bound, and the newest stay.
TEST(BlobParts, OfWhatWasAnnouncedBeforeTheSceneCameAreBounded) {
    BadLink link(1000);
    std::vector<Blob> arrays;
    for (unsigned i = 1; i <= 50; ++i) {
        arrays.emplace_back(content(kBytes, i));
        link.comes().hear(message::BlobNotice{i, {infoOf(arrays.back())}});
        link.chunks(arrays.back(), 0, 2);
        link.goes();
        EXPECT_TRUE(link.keeps(arrays.back()));
        ASSERT_LE(link.keptBytes(), 1000 + kBytes) << "after " << i << " connections";
    }
    EXPECT_TRUE(link.keeps(arrays[arrays.size() - 2]));
    EXPECT_FALSE(link.keeps(arrays[0]));
}

/// A connection that ends before it has heard what the scene names says nothing against the arrays of the one before.
TEST(BlobParts, OfArraysThatAreStillWantedComeThroughConnectionsThatHearNothing) {
    const Blob scene(content(kBytes, 1)), array(content(kBytes, 2));
    BadLink link;
    link.named = {infoOf(array)};
    link.comes().hear(message::Snapshot{listAt(5_seq), infoOf(scene)});
    link.chunks(scene, 0, 5);
    link.chunks(array, 0, 2);
    link.goes();
    for (int i = 0; i < 5; ++i) {
        (void)link.comes();
        link.goes();
    }
    const Blob later(content(kBytes, 3));
    ClientFixture& client = link.comes();
    client.hear(message::Snapshot{listAt(5_seq), infoOf(later)});
    link.chunks(later, 0, 5);
    const auto asked = client.sent<message::BlobRequest>(ChannelKind::kBulk);
    const auto first = std::ranges::find(asked, array.id(), &message::BlobRequest::id);
    ASSERT_NE(first, asked.end());
    EXPECT_EQ(first->offset, 200u);
}

TEST(BlobParts, OfAnyHistoryStayWithinTheirBound) {
    forSeeds(300, [](Random& random) {
        constexpr std::size_t kMost = 2000;
        BadLink link(kMost);
        std::vector<Blob> blobs;
        for (unsigned i = 0; i < 12; ++i) blobs.emplace_back(content(kBytes, i + 1));
        for (int i = 0; i < 60; ++i) {
            std::set<std::size_t> wanted;
            ClientFixture& client = link.comes();
            for (std::size_t notices = below(random, 3); notices > 0; --notices) {
                const std::size_t which = below(random, blobs.size());
                if (!wanted.insert(which).second) continue;
                client.hear(message::BlobNotice{notices, {infoOf(blobs[which])}});
            }
            if (oneIn(random, 2)) {
                const std::size_t which = below(random, blobs.size());
                if (wanted.insert(which).second)
                    client.hear(oneIn(random, 2) ? message::Snapshot{listAt(5_seq), infoOf(blobs[which])}
                                                 : message::Snapshot{listAt(5_seq, {infoOf(blobs[which])})});
            }
            // Of what was asked for some comes.
            const auto asked = client.sent<message::BlobRequest>(ChannelKind::kBulk);
            for (const message::BlobRequest& request : asked) {
                const auto blob = std::ranges::find(blobs, request.id, &Blob::id);
                if (request.offset + request.length < kBytes && !oneIn(random, 4))
                    link.chunks(*blob, request.offset / 100, 1);
            }
            link.goes();
            ASSERT_LE(link.keptBytes(), kMost + wanted.size() * kBytes) << "connection " << i;
        }
    });
}

}  // namespace
}  // namespace tessera
