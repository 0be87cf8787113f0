/// A whole server and its render hosts as threads of the test, over real sockets on loopback: for claims about ports,
/// tokens and bytes on the way, which need no process of their own.
#pragma once

#include <cstdio>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "client/replica/Injection.h"
#include "common/base/Log.h"
#include "common/net/Transport.h"
#include "server/sim/FrameLoop.h"
#include "tests/integration/LiveWall.h"

namespace tessera::test {

/// The words of a program that runs in a thread, and how it has ended.
class ThreadProgram {
public:
    ThreadProgram(const std::string& folder, const std::string& name, const std::string& program);
    virtual ~ThreadProgram();
    ThreadProgram(const ThreadProgram&) = delete;
    ThreadProgram& operator=(const ThreadProgram&) = delete;

    /// All it has said so far.
    [[nodiscard]] std::string output();
    /// As Process has it.
    [[nodiscard]] std::optional<std::string> waitForText(const std::string& text, std::chrono::milliseconds timeout);
    /// The exit code of the program that does the same. Nothing at the deadline.
    [[nodiscard]] std::optional<int> waitForExit(std::chrono::milliseconds timeout);

protected:
    /// `work` returns what the program's main would serve.
    void start(std::function<Expected<void>()> work);
    void say(const std::string& line);
    void join();

    std::FILE* file_;
    Log log_;

private:
    std::string path_;
    std::thread thread_;
    std::promise<int> end_;
    std::shared_future<int> exit_ = end_.get_future().share();
};

/// `words` follow the program's name. Its tokens lie where this user's programs look for them.
class ThreadServer final : public ThreadProgram {
public:
    ThreadServer(const std::string& folder, std::vector<std::string> words);
    /// Stops it.
    ~ThreadServer() override;
    /// As SIGTERM does.
    void stop();

private:
    class Stopping;
    std::shared_ptr<Stopping> stopping_;
};

/// Draws with OSMesa, and shares nothing with its neighbours. Ends with its server.
class ThreadHost final : public ThreadProgram {
public:
    struct Options {
        Address server;
        std::string name, output;
        std::string keys = {};  ///< folder; empty: none
        std::string surface = "osmesa";
        Injection injection = {};
    };
    ThreadHost(const std::string& folder, const Options& options);
    ~ThreadHost() override;
    /// Waits until it has joined its server, or has ended. Who has not dials on when the server ends, and never ends.
    void settle();
};

/// The same as LiveWall, of threads.
class ThreadWall {
public:
    explicit ThreadWall(const LiveWallOptions& options);
    ~ThreadWall();

    [[nodiscard]] const std::string& address() const { return address_; }
    [[nodiscard]] ThreadServer& server() { return *server_; }
    [[nodiscard]] std::string token() const { return tokenAt(address_); }
    [[nodiscard]] std::string tokenFile() const { return folder_.write("token", token() + "\n"); }
    /// `more`: what it is beside its name, its server and its folder of pictures.
    ThreadHost& startClient(const std::string& host, ThreadHost::Options more = {});
    [[nodiscard]] std::int64_t shownFrame(const std::string& tile) const { return shownFrameIn(output(), tile); }
    [[nodiscard]] bool waitForFrame(const std::string& tile, std::int64_t frame,
                                    std::chrono::milliseconds timeout) const;
    /// tessera-ctl with this wall's address.
    [[nodiscard]] Outcome ctl(std::vector<std::string> words) const;
    [[nodiscard]] nlohmann::json finish();
    [[nodiscard]] nlohmann::json waitForEnd(std::chrono::milliseconds timeout);

    [[nodiscard]] const std::string& folder() const { return folder_.path(); }
    [[nodiscard]] std::string output() const { return folder_.path() + "/out"; }
    [[nodiscard]] std::string logs() const;

private:
    void stop();

    TemporaryFolder folder_;
    std::string address_;
    std::unique_ptr<ThreadServer> server_;
    std::map<std::string, std::unique_ptr<ThreadHost>> hosts_;
};

/// What tessera-server says of a command line that it does not take.
struct Refused {
    std::optional<int> exitCode;
    std::string words;
};
[[nodiscard]] Refused refusedWords(const std::vector<std::string>& words);

/// tessera-ctl in the calling thread.
[[nodiscard]] Outcome ctlHere(const std::vector<std::string>& words);

}  // namespace tessera::test
