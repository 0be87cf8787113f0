#include "tests/integration/LiveWall.h"

#include <signal.h>

#include "common/access/LocalWalls.h"
#include "common/image/SharedFrame.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {

using namespace std::chrono_literals;

std::string wallWithSync(const TemporaryFolder& folder, const std::string& sync) {
    const std::string text = readText(std::string(TESSERA_SOURCE_DIR) + "/deploy/walls/2x2.wall");
    return folder.write("2x2.wall", text.substr(0, text.find("sync {")) + "sync { " + sync + " }\n");
}

std::vector<std::string> serverWords(const LiveWallOptions& options, const std::string& folder) {
    const std::string wall = options.wall.empty() ? "2x2" : options.wall;
    std::vector<std::string> words = {"--wall",   wall,          "--scene",  options.scene,
                                      "--listen", "127.0.0.1:0", "--report", folder + "/report.json"};
    if (!options.size.empty()) words.insert(words.end(), {"--size", options.size, "--samples", "1"});
    words.insert(words.end(), options.server.begin(), options.server.end());
    return words;
}

nlohmann::json reportIn(const std::string& folder) {
    const std::string text = readText(folder + "/report.json");
    return text.empty() ? nlohmann::json() : nlohmann::json::parse(text);
}

std::string tokenAt(const std::string& address) {
    const Expected<Address> server = parseAddress(address);
    const Expected<std::string> word = server ? accessTo(*server) : std::string();
    return word ? *word : "";
}

std::int64_t shownFrameIn(const std::string& output, const std::string& tile) {
    const auto image = readSharedFrame(output + "/tiles/" + tile + "/shown.frame");
    return image ? static_cast<std::int64_t>(image->frame) : -1;
}

LiveWall::LiveWall(const LiveWallOptions& options) {
    std::vector<std::string> command = serverWords(options, folder_.path());
    command.insert(command.begin(), program("tessera-server"));
    server_ = std::make_unique<Process>(folder_.path(), "server", command);
    address_ = server_->waitForText("listening on ", 20s).value_or("");
}

Process& LiveWall::startClient(const std::string& host, std::vector<std::string> more) {
    std::vector<std::string> command = {
        program("tessera-client"), "--server", address_, "--host", host, "--output", output()};
    command.insert(command.end(), more.begin(), more.end());
    clients_[host] = std::make_unique<Process>(folder_.path(), host, command);
    return *clients_[host];
}

bool LiveWall::waitForFrame(const std::string& tile, std::int64_t frame, std::chrono::milliseconds timeout) const {
    return eventually([&] { return shownFrame(tile) >= frame; }, timeout);
}

Outcome LiveWall::ctl(std::vector<std::string> words) const {
    std::vector<std::string> command = {program("tessera-ctl"), "--server", address_};
    command.insert(command.end(), words.begin(), words.end());
    return run(folder_.path(), command, 30s);
}

nlohmann::json LiveWall::finish() {
    server_->signal(SIGTERM);
    return waitForEnd(30s);
}

nlohmann::json LiveWall::waitForEnd(std::chrono::milliseconds timeout) {
    if (!server_->waitForExit(timeout)) return {};
    for (auto& [host, client] : clients_) (void)client->waitForExit(10s);
    return reportIn(folder_.path());
}

std::string LiveWall::logs() const {
    std::string all = "--- server\n" + server_->output();
    for (const auto& [host, client] : clients_) all += "--- " + host + "\n" + client->output();
    return all;
}

std::string tileOf(const std::string& host) {
    const bool right = host.ends_with("right"), upper = host.starts_with("upper");
    return std::string("front-") + (right ? "1" : "0") + "-" + (upper ? "1" : "0");
}

}  // namespace tessera::test
