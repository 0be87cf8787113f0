/// The server at work: joins network, session, simulation and report into frames.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/AccessToken.h"
#include "common/base/Log.h"
#include "common/base/ServiceNotifier.h"
#include "common/net/Platform.h"
#include "common/tls/KeyRing.h"
#include "common/wall/Exposure.h"
#include "common/wall/Showing.h"
#include "common/wall/Wall.h"
#include "server/import/Importer.h"
#include "server/sim/audit/AuditBook.h"

namespace tessera {

class FileSystem;

struct ServerOptions {
    Wall wall;
    std::vector<std::string> scenes;
    Placing placing = {};  ///< of each of the scenes
    Address listen{.host = "127.0.0.1", .port = 0};
    AccessTokens access = {};            ///< empty: nobody is asked for any
    std::string owner = {};              ///< whose programs may come in, for people
    std::shared_ptr<KeyRing> keys = {};  ///< the server's; null: no link is sealed
    /// The text of a panel that the door lets visitors in to, beside those of the keys; null: none. May be empty.
    std::function<std::shared_ptr<const std::string>(const std::string& name)> panelOf = {};
    bool insecure = false;  ///< whoever comes from another machine needs no key
    ImportOptions import;
    std::vector<std::string> allowed;  ///< folders whose files applications may load, beside the assets
    std::uint64_t frames = 0;          ///< 0: until stopped
    double rateHz = 0;                 ///< 0: as fast as the wall draws
    std::string camera;                ///< node path; empty: the first enabled camera
    std::string reportPath;            ///< empty: no report
    std::string recordPath;            ///< empty: no recording
    std::string journalPath;           ///< empty: no journal
    /// The journal writes with these; null: the system's own calls.
    std::shared_ptr<FileSystem> journalFiles = {};
    AuditBook* audit = nullptr;          ///< null: nobody keeps who does what; outlives the loop
    Showing showing = Showing::kScene;   ///< until somebody asks for something else
    bool takesInput = true;              ///< of windows and applications: false: the view moves by hand alone
    bool notices = true;                 ///< walls say what is wrong with programs of materials
    bool studio = true;                  ///< models that bring no light are shown in one (common/wall/Studio.h)
    ExposureWish exposure = {};          ///< in place of what the scene says
    bool reload = false;                 ///< files that change on disk are taken in again
    unsigned threads = 1;                ///< of the collision pipeline; what comes out does not depend on it
    ServiceNotifier* service = nullptr;  ///< that watches the frame thread; null: nobody does
    std::function<void(std::uint64_t done, std::uint64_t total)> onProgress;  ///< may be empty
    std::function<void(const Address&)> onBound = {};  ///< before anybody can connect; may be empty
    std::function<void(const Address&)> onListening;
    Platform platform = {};
};

/// Runs one server to its end. The calling thread becomes the frame thread: it owns session, scene and report; network
/// and imports run on threads of their own and hand their results over.
class FrameLoop {
public:
    FrameLoop(ServerOptions options, Log& log);
    ~FrameLoop();

    /// Returns when all frames have been shown or `stop` was called. Errors: cannot listen, a recording or a
    /// journal that cannot be begun, a scene that cannot be read, a camera that is not there, no frame shown although
    /// some were asked for.
    [[nodiscard]] Expected<void> run();
    /// `run` step by step, for whoever drives more than one server in a thread: `begin`, then `turn` until it is `over`
    /// or fails, then `end`. A turn waits for what happens next, at the longest until `nextWake`.
    [[nodiscard]] Expected<void> begin();
    [[nodiscard]] Expected<void> turn();
    [[nodiscard]] bool over() const;
    [[nodiscard]] TimePoint nextWake() const;
    [[nodiscard]] Expected<void> end();
    /// From any thread or signal handler's thread: ends the show after the open frame.
    void stop();
    /// From any thread: from now on these tokens let in, and whoever came in by others is closed.
    void renewAccess(AccessTokens access);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
