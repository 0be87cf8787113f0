/// Which files can be imported, as far as their names say: as the importer itself tells it.
#include "server/import/ModelEndings.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <regex>
#include <string>

namespace tessera {
namespace {

TEST(ModelEndings, AreThoseThatTheImporterReads) {
    std::FILE* const list = ::popen(TESSERA_BIN_DIR "/tessera-import --endings", "r");
    ASSERT_NE(list, nullptr);
    std::string says;
    std::array<char, 4096> piece{};
    for (std::size_t got = 0; (got = std::fread(piece.data(), 1, piece.size(), list)) > 0;)
        says.append(piece.data(), got);
    ASSERT_EQ(::pclose(list), 0);
    const std::regex ending("\\.([a-z0-9]+)(?=[.\n])");
    std::size_t count = 0;
    for (std::sregex_iterator at(says.begin(), says.end(), ending), end; at != end; ++at, ++count)
        EXPECT_TRUE(isModelEnding((*at)[1].str())) << (*at)[1].str() << " in: " << says;
    EXPECT_GT(count, 60u) << says;
    for (const char* none : {"", "nothing", "png", "mtl", "bin", "txt", "GLB", "panel"})
        EXPECT_FALSE(isModelEnding(none)) << none;
}

}  // namespace
}  // namespace tessera
