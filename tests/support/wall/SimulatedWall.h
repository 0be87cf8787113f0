/// A whole wall in one process: the server's frame loop, render hosts that draw, applications, and nothing between them
/// but bytes. Time, network and work beside the frames are a World's.
///
///     SimulatedWall wall({.scene = "node { … }", .wall = "2x2"});
///     wall.application().ask(request::MoveNode{…});
///     EXPECT_EQ(wall.pictureOf(30), otherWall.pictureOf(30));
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/draw/surface/Surface.h"
#include "client/replica/RenderHost.h"
#include "client/replica/ServerLink.h"
#include "common/application/ApplicationSession.h"
#include "server/sim/FrameLoop.h"
#include "tests/support/wall/World.h"
#include "tests/unit/ReadableLog.h"
#include "tests/unit/TestFolder.h"

namespace tessera::simulation {

struct WallOptions {
    std::string scene = {};           ///< text of a .tsct file, or the path of a file
    std::string wall = "2x2";         ///< a shipped wall, or a file
    int widthPx = 64, heightPx = 36;  ///< of all screens together; width 0: as the file has it
    std::optional<CullerKind> culler = {};
    std::map<std::string, CullerKind> cullers = {};  ///< of hosts that have another one
    bool hosts = true;                               ///< false: none is there until `startHosts`
    bool draws = true;                               ///< false: hosts follow the scene and show nothing
    std::string journal = {};                        ///< folder; empty: none
    std::shared_ptr<FileSystem> journalFiles = {};   ///< null: the system's
    std::string record = {};                         ///< file, of the first server alone; empty: none
    bool reload = false;                             ///< files that change are taken in again
    double rateHz = 60;
    std::uint64_t frames = 0;                          ///< 0: without end
    std::vector<std::string> server = {};              ///< more words of tessera-server's command line
    std::map<std::string, Injection> injections = {};  ///< of hosts that shall have faults
    std::uint64_t seed = 1;
};

/// The words of a program, and its exit code.
struct CommandOutcome {
    int exitCode = -1;
    std::string output;
};

class SimulatedWall;

/// As runHost joins them: a session, and a thread that draws.
class SimulatedHost {
public:
    SimulatedHost(World& world, std::string name, const WallOptions& options, Address server,
                  const std::string& output);
    ~SimulatedHost();

    [[nodiscard]] const std::string& name() const { return name_; }
    /// The server has said that it is over, or it has given up.
    [[nodiscard]] bool ended() const { return link_->over(); }
    [[nodiscard]] World::Program& session() { return *linkProgram_; }
    [[nodiscard]] World::Program& drawing() { return *drawProgram_; }
    /// Somebody does this at its windows.
    void input(const InputState& state) { link_->tell({Attempt{}, outcome::Input{state}}); }
    [[nodiscard]] std::string log() const { return words_.said(); }

private:
    void draw();

    World& world_;
    std::string name_;
    mutable test::ReadableLog words_;
    Channel<ServerLink::Event> events_{4096};
    WorkQueue work_{1024};
    BlobStore store_;
    BlobShelf shelf_{store_, std::uint64_t{1} << 30};
    std::unique_ptr<Surface> surface_;
    std::unique_ptr<ServerLink> link_;  ///< outlives the host, which speaks to it to its end
    std::unique_ptr<RenderHost> host_;
    std::shared_ptr<World::Program> linkProgram_, drawProgram_;
    bool going_ = true, ahead_ = false, drawEnded_ = false;
};

/// An application without a thread: it sees the scene, and says what it is told to.
class SimulatedApplication {
public:
    SimulatedApplication(World& world, std::string name, Address server);
    ~SimulatedApplication();

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] const Aspect& scene() const { return scene_; }
    [[nodiscard]] Sequence sequence() const { return sequence_; }
    [[nodiscard]] bool hasScene() const { return hasScene_; }
    /// Frames of which it was told, as it has subscribed to (`Subscription::frames`), and the number of the last one.
    [[nodiscard]] std::uint64_t framesTold() const { return framesTold_; }
    [[nodiscard]] FrameNumber lastFrame() const { return lastFrame_; }
    /// How many of them took longer than kLateMs.
    [[nodiscard]] std::uint64_t lateFrames() const { return lateFrames_; }
    static constexpr double kLateMs = 400;
    [[nodiscard]] bool ended() const { return session_->ended(); }
    [[nodiscard]] const std::string& endedBecause() const { return endedBecause_; }
    /// Called after each list; `whole`: it is the scene anew. May be empty.
    std::function<void(bool whole)> onList = {};

    /// Sends it. The answer comes with time (`answer`).
    std::uint64_t say(const ApplicationRequest& request);
    std::uint64_t sayBytes(ByteSlice body);
    void upload(std::span<const Blob> blobs);
    /// None yet: it is awaited.
    [[nodiscard]] const Expected<ApplicationAnswer>* answer(std::uint64_t id) const;
    /// Runs the world until the answer is there. kNetwork: within `atMost` it was not.
    template <typename R>
    [[nodiscard]] Expected<typename R::Answer> ask(const R& request, Duration atMost = std::chrono::seconds(20)) {
        Expected<ApplicationAnswer> told = await(say(request), atMost);
        if (!told) return tl::unexpected(told.error());
        if (auto* answer = std::get_if<typename R::Answer>(&*told)) return std::move(*answer);
        return fail(ErrorCode::kBadInput, "an answer of another kind");
    }
    [[nodiscard]] Expected<ApplicationAnswer> await(std::uint64_t id, Duration atMost);
    /// All that have come and nobody waits for.
    [[nodiscard]] std::vector<std::pair<std::uint64_t, Expected<ApplicationAnswer>>> takeAnswers();

private:
    void take(Incoming incoming);

    World& world_;
    std::string name_;
    std::deque<LinkEvent> events_;
    std::shared_ptr<World::Program> program_;
    std::unique_ptr<Transport> transport_;
    BlobStore blobs_;
    Aspect scene_;
    Sequence sequence_;
    bool hasScene_ = false;
    std::uint64_t framesTold_ = 0, lateFrames_ = 0;
    FrameNumber lastFrame_;
    std::string endedBecause_;
    std::map<std::uint64_t, std::optional<Expected<ApplicationAnswer>>> answers_;
    std::uint64_t lastRequest_ = 0;
    std::unique_ptr<ApplicationSession> session_;
};

class SimulatedWall {
public:
    explicit SimulatedWall(WallOptions options);
    ~SimulatedWall();

    [[nodiscard]] World& world() { return world_; }
    [[nodiscard]] const Wall& wall() const { return wall_; }
    [[nodiscard]] Address address() const { return address_; }
    /// The wall's own, gone with it.
    [[nodiscard]] const std::string& folder() const { return folder_.path(); }
    /// For a program of the calling thread, which lets the wall go on while it waits.
    [[nodiscard]] Platform platform(const std::string& program);
    /// tessera-ctl with this wall's address.
    [[nodiscard]] CommandOutcome ctl(std::vector<std::string> words);

    /// One that follows the scene; connected and with the scene when it comes back.
    [[nodiscard]] SimulatedApplication& application(const std::string& name = "app");
    [[nodiscard]] const std::map<std::string, std::unique_ptr<SimulatedApplication>>& applications() const {
        return applications_;
    }
    /// Null: it is not there.
    [[nodiscard]] SimulatedApplication* findApplication(const std::string& name) {
        const auto found = applications_.find(name);
        return found == applications_.end() ? nullptr : found->second.get();
    }
    void removeApplication(const std::string& name) { applications_.erase(name); }
    [[nodiscard]] SimulatedHost& host(const std::string& name) { return *hosts_.at(name); }
    [[nodiscard]] const std::map<std::string, std::unique_ptr<SimulatedHost>>& hosts() const { return hosts_; }
    /// As a killed process ends: without a word.
    void killHost(const std::string& name);
    /// `injection`: that it shall have; none: that of its options.
    void startHost(const std::string& name, const std::optional<Injection>& injection = {});
    void startHosts();
    void killServer();
    /// Again, with the same options. Throws Violation where it does not begin.
    void startServer();
    /// The same; an error where it does not begin, and then there is none.
    [[nodiscard]] Expected<void> tryToStartServer();
    [[nodiscard]] bool serverLives() const { return server_ && !serverEnded_; }
    /// Why it has ended; empty: it goes on, or ended in order.
    [[nodiscard]] const std::string& serverError() const { return serverError_; }
    void stopServer();
    /// Stops it, and waits for it and its hosts. Its report; null: there is none.
    [[nodiscard]] nlohmann::json finish();

    /// The number of the frame that all tiles show. It looks twice in a millisecond at most.
    [[nodiscard]] std::optional<std::uint64_t> shownFrame() const;
    /// The number of the frame that this tile shows; none: it shows none yet.
    [[nodiscard]] std::optional<std::uint64_t> shownFrame(const std::string& tile) const;
    /// Runs until all tiles show this frame. The exact stitch of them; Violation: it was never shown by all.
    [[nodiscard]] Picture pictureOf(std::uint64_t frame, Duration atMost = std::chrono::seconds(60));
    /// The exact stitch of what all tiles show now, screens side by side, of two eyes the left one's; none where they
    /// show different frames.
    [[nodiscard]] std::optional<Picture> picture() const { return picture({}); }
    /// The same of one screen alone; empty: of all.
    [[nodiscard]] std::optional<Picture> picture(const std::string& screen) const;
    /// The picture that a tile shows now. Violation: there is none.
    [[nodiscard]] Picture tilePicture(const std::string& tile) const;
    /// The lines that everybody has logged, for messages of tests.
    [[nodiscard]] std::string logs() const;

private:
    [[nodiscard]] ServerOptions serverOptions();

    WallOptions options_;
    test::TestFolder folder_;
    World world_;
    Wall wall_;
    Address address_;
    mutable test::ReadableLog words_;
    std::unique_ptr<FrameLoop> server_;
    std::shared_ptr<World::Program> serverProgram_;
    bool serverEnded_ = false;
    std::string serverError_;
    mutable TimePoint lookAgain_{};               ///< at what is shown
    mutable std::optional<std::uint64_t> shown_;  ///< as it was when somebody looked
    std::map<std::string, std::unique_ptr<SimulatedHost>> hosts_;
    std::map<std::string, std::unique_ptr<SimulatedApplication>> applications_;
};

}  // namespace tessera::simulation
