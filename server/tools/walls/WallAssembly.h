/// Pictures on planes, put together to a wall: the way that all readers of other walls share.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/tools/walls/ForeignWall.h"
#include "server/tools/walls/WallReading.h"

namespace tessera {

/// One picture that a host draws on a plane: metres, right-handed, +Y up, -Z ahead.
struct PlanePicture {
    std::string name;  ///< for its screen
    std::string host;  ///< as its file calls it
    std::string user;  ///< as `addUser` returned it
    Vec3d lowerLeft = Vec3d::Zero(), lowerRight = Vec3d::Zero(), upperLeft = Vec3d::Zero();
    int widthPx = 0, heightPx = 0;
    Eye eye = Eye::kCenter;                       ///< where one eye's picture fills it
    StereoPacking stereo = StereoPacking::kNone;  ///< else both eyes are in it
    bool swapEyes = false, flipX = false, flipY = false;
};

/// A program's word for how two eyes share a picture, or which of them one is for.
struct StereoWord {
    const char* word;
    Eye eye = Eye::kCenter;
    StereoPacking packing = StereoPacking::kNone;
    bool swapped = false;
    bool fromBelow = false;  ///< its rows are counted from the lower edge
};

/// Bounds on what files say.
inline constexpr double kFarthestM = 1000, kMostPicturePx = 16384;

/// Makes the wall. Corners are kept to a nanometre. Pictures of one plane that stand in columns and rows, with whole
/// pixels between them (to a fiftieth of one), become a screen with a grid; others stay screens of their own.
class WallAssembly {
public:
    explicit WallAssembly(WallReading& reading) : reading_(reading) {}

    /// The name under which the head is known here.
    [[nodiscard]] std::string addUser(User user);
    /// The same, but that of one that was added before, where the two are one: a head whose eyes are cameras.
    [[nodiscard]] std::string addUserOnce(User user);
    /// Where a host's client would be started; the first one counts. Nothing for addresses of this machine itself.
    void setMachine(const std::string& host, const std::string& address, const std::string& display = {});
    void add(PlanePicture picture);

    /// `source` is the program's name. The refusal of `reading`, that nothing is left, or that of checkWall.
    [[nodiscard]] Expected<ForeignWall> finish(const std::string& source);

private:
    static constexpr std::size_t kMostPictures = 4096;
    WallReading& reading_;
    std::vector<User> users_;
    std::set<std::string> userNames_;
    std::map<std::string, Machine> machines_;
    std::vector<PlanePicture> pictures_;
};

}  // namespace tessera
