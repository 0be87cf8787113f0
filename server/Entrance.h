/// The ways into a server on its machine: its user's programs, and the console.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "common/access/ServerTokens.h"
#include "common/base/AccessToken.h"
#include "common/base/Log.h"
#include "server/door/Door.h"
#include "server/door/UploadFolder.h"
#include "server/sim/FrameLoop.h"

namespace tessera {

/// The server's user, for people.
[[nodiscard]] std::string nameOfUser();

/// A panel of --panel.
struct ServedPanel {
    std::string file;
    DoorPanel door;
    std::shared_ptr<const std::string> text;
};
/// Reads the files of --panel. kUsage: there are too many.
[[nodiscard]] Expected<std::vector<ServedPanel>> readPanels(const std::vector<std::string>& files);

/// The ways into a server on its machine: its tokens, where its user's programs find them, and the console.
///
/// Tokens serve for one protection (`WallProtection`). Where it changes, also while the server runs, all are new.
/// Not thread-safe. `keepWatch` may have a thread of its own once nobody calls anything else.
class Entrance {
public:
    /// `console`: none is wanted.
    /// `say`: takes lines for people.
    Entrance(std::optional<Address> console, DoorReach reach, std::vector<ServedPanel> panels, ServerTokens tokens,
             std::string wall, std::function<void(const std::string&)> say, Log& log);

    /// Before anybody is told of them.
    [[nodiscard]] const AccessTokens& tokens() const { return tokens_.tokens(); }
    /// Sets the folder of uploads for the console that is opened afterwards.
    void setFiles(std::shared_ptr<UploadFolder> uploads,
                  std::function<void(const Entrant& who, std::string_view did, const std::string& path)> onFile);
    /// Opens the console, before anybody can dial in: who does finds the tokens. The wall goes on where there is none.
    void open(const Address& server);
    /// Says the links. Where systemd's journal reads them it says how people get one: its readers are others.
    void describe(const std::string& group) const;

    /// Ends the tokens and links that were handed out wherever the protection is another one. Until `done`.
    void keepWatch(const std::stop_token& done, FrameLoop& loop);

private:
    [[nodiscard]] std::string look(FrameLoop& loop, const std::string& lastFault);
    void sayLinks() const;
    [[nodiscard]] std::vector<DoorPanel> doorPanels() const;
    void openDoor(const Address& server);

    std::optional<Address> console_;
    DoorReach reach_;
    std::vector<ServedPanel> panels_;
    std::string wall_;
    std::shared_ptr<UploadFolder> uploads_;
    std::function<void(const Entrant&, std::string_view, const std::string&)> onFile_;
    std::function<void(const std::string&)> say_;
    Log& log_;
    ServerTokens tokens_;
    std::unique_ptr<Door> door_;
};

}  // namespace tessera
