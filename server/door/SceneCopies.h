/// The scene as a file, as it is now.
#pragma once

#include <atomic>

#include "common/scenefile/SceneFile.h"
#include "server/door/Beside.h"
#include "server/door/HttpMessage.h"

namespace tessera {

/// Follows the scene as an application does until it has all of it, and writes it into a file without a name: on a
/// thread of its own, one at a time. All members on the door's thread.
class SceneCopies {
public:
    /// Of its arrays: they are held twice while it is written.
    static constexpr std::uint64_t kMaxArrayBytes = std::uint64_t{512} << 20;
    static constexpr std::chrono::seconds kPatience{120};

    explicit SceneCopies(boost::asio::io_context& io) : writer_(io) {}
    /// `word`: lets an application in at `server`. `folder`: where the file lies meanwhile. 503: one is being written.
    void ask(const Address& server, const std::string& word, SceneEncoding encoding, const std::string& folder,
             const AnswerHttp& answer);
    /// What is under way ends soon.
    void finish() {
        stops_ = true;
        writer_.finish();
    }

private:
    Beside writer_;
    bool busy_ = false;
    std::atomic<bool> stops_ = false;
};

}  // namespace tessera
