/// Keys of a wall that is started for one run.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/tls/Certificate.h"
#include "deploy/wall/WallKeys.h"

namespace tessera {
namespace {

TEST(WallKeys, OfOneRunGoWithItAndTheNextRunHasOthers) {
    std::string folder, first;
    {
        const Expected<WallKeys> keys = WallKeys::forThisRun("cave");
        ASSERT_TRUE(keys) << keys.error().message;
        folder = keys->folder();
        const Expected<std::string> authority = KeyFolder(folder).authorityCertificate();
        ASSERT_TRUE(authority) << authority.error().message;
        first = Certificate::read(*authority)->fingerprint;
        EXPECT_EQ(std::filesystem::status(folder).permissions(), std::filesystem::perms::owner_all);
        EXPECT_FALSE(std::filesystem::exists(folder + "/authority.pem")) << "nobody else makes keys of it";
    }
    EXPECT_FALSE(std::filesystem::exists(folder));
    const Expected<WallKeys> next = WallKeys::forThisRun("cave");
    ASSERT_TRUE(next) << next.error().message;
    const Expected<std::string> authority = KeyFolder(next->folder()).authorityCertificate();
    ASSERT_TRUE(authority) << authority.error().message;
    EXPECT_NE(Certificate::read(*authority)->fingerprint, first) << "no host of the run before is let in";
}

}  // namespace
}  // namespace tessera
