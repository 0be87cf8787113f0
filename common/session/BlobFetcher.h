/// Fetches blobs in chunks, a bounded number of them under way, and believes nothing that does not hash right.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/base/BlobMaker.h"
#include "common/base/Limits.h"
#include "common/session/Messages.h"

namespace tessera {

struct FetchLimits {
    std::size_t maxBlobBytes = limits::kMaxBlobBytes;
    std::uint32_t chunkBytes = 256 * 1024;
    std::uint32_t chunksInFlight = 8;
    /// Where else a blob may be had whole: looked at when it is wanted, and once more before its first chunk is asked
    /// for. May be empty. What it gives has been proved to be that blob.
    std::function<Blob(const BlobInfo&)> elsewhere = {};
    /// Where the bytes of a large one are put as they come (BlobMaker). May be empty, and may give none.
    std::function<std::unique_ptr<BlobPlace>(const BlobInfo&)> place = {};
    /// Which of many that are wanted at once is fetched first, 0 to 1: those who find with each other what one of them
    /// has fetched begin at different places.
    double firstShare = 0;
    /// Of pieces that earlier connections have brought and the last one has not wanted: beyond it the oldest go.
    std::size_t maxUnwantedBytes = std::size_t{256} << 20;
    /// Larger blobs that come once the whole scene is known are not looked for elsewhere: to prove what is found takes
    /// as long as to hash it, and who asks draws by then. Who enters may take that time.
    std::uint64_t maxLateElsewhereBytes = std::uint64_t{8} << 20;
};

/// Pure state machine. Memory grows with what has arrived, not with what was announced.
class BlobFetcher {
public:
    explicit BlobFetcher(FetchLimits limits) : limits_(std::move(limits)) {}

    void hold(const BlobId& id) { held_.insert(id); }
    void drop(const BlobId& id) { held_.erase(id); }
    [[nodiscard]] bool holds(const BlobId& id) const { return held_.contains(id); }

    /// First come, first fetched; what is held or wanted already costs nothing. Returns the blobs that need no fetch:
    /// those without bytes, and those found elsewhere. kLimit: a blob larger than allowed.
    [[nodiscard]] Expected<std::vector<Blob>> want(const std::vector<BlobInfo>& blobs);
    /// The same of a blob in which the whole scene lies. What has come of earlier ones nobody wants any more.
    [[nodiscard]] Expected<std::vector<Blob>> wantScene(const BlobInfo& blob);
    /// All that the whole scene names has been wanted: at the end of this connection, pieces of anything else go.
    void sceneIsKnown() { sceneKnown_ = true; }
    /// What to ask for now. Only while the bulk connection is open.
    [[nodiscard]] std::vector<message::BlobRequest> requests();
    /// What `requests` has found elsewhere instead of asking for it.
    [[nodiscard]] std::vector<Blob> takeFound() { return std::exchange(found_, {}); }
    /// Whether chunks are under way.
    [[nodiscard]] bool waiting() const { return !inFlight_.empty(); }
    /// A blob, when this chunk was its last. Chunks may come in any order, but only those asked for. kNotFound: the
    /// server has this blob no more, and nobody has wanted it since it was asked for: it is wanted no more.
    [[nodiscard]] Expected<std::optional<Blob>> chunk(const message::BlobChunk& chunk);
    /// The bulk connection broke: what was under way is asked for again.
    void interrupted();

    struct Fetch {
        std::uint64_t sizeBytes = 0;
        std::uint64_t asked = 0;               ///< every byte before this has been asked for
        std::uint64_t received = 0;            ///< in any order
        std::unique_ptr<BlobMaker> made = {};  ///< null: nothing has come
        std::uint64_t end = 0;                 ///< behind all that has come: as much memory as it may take
        bool scene = false;                    ///< it holds a whole scene
        bool late = false;                     ///< wanted once the whole scene was known
        std::uint32_t unwanted = 0;            ///< connections that have ended since the last that wanted it
        std::uint64_t begun = 0;               ///< by the count of all wishes: the one that began it
        std::uint64_t wanted = 0;              ///< the last one
    };
    /// Blobs of which a part is here.
    using Parts = std::unordered_map<BlobId, Fetch>;
    /// Nothing is wanted any more; what has come of it goes to the next connection. So do, within `maxUnwantedBytes`,
    /// pieces that earlier ones wanted, where this one ended before it knew what the scene names.
    [[nodiscard]] Parts takeParts();
    /// Where one of these is wanted, the rest of it is fetched.
    void resume(Parts parts) { parts_ = std::move(parts); }
    void forgetParts() { parts_.clear(); }

private:
    struct Asked {
        message::BlobRequest request;
        std::uint64_t wanted = 0;  ///< when it was asked for: the last wish for this blob
    };

    [[nodiscard]] Blob lookElsewhere(const BlobInfo& blob, bool late) const;
    void giveUp(const BlobId& id);

    FetchLimits limits_;
    std::unordered_set<BlobId> held_;
    std::unordered_map<BlobId, Fetch> fetches_;
    Parts parts_;                              ///< of an earlier connection, not wanted yet
    std::deque<BlobId> order_;                 ///< of those not wholly asked for
    std::vector<Asked> inFlight_;              ///< those of blobs that were given up too, until their answers have come
    std::vector<message::BlobRequest> again_;  ///< to be asked for once more
    std::uint64_t wishes_ = 0;
    std::vector<Blob> found_;
    bool sceneKnown_ = false;
};

}  // namespace tessera
