/// The files of the console's page: what is compiled in, as what it is sent, and what may not stand in it.
#include "server/door/PageFiles.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>

#include "server/door/Pages.h"

namespace tessera {
namespace {

TEST(PageFiles, AreTheFolderByteForByte) {
    ASSERT_GT(pageFiles().size(), 10u);
    for (const PageFile& file : pageFiles()) {
        std::ifstream in(std::string(TESSERA_SOURCE_DIR "/server/door/page/").append(file.name), std::ios::binary);
        EXPECT_EQ(std::string((std::istreambuf_iterator<char>(in)), {}), file.text) << file.name;
    }
}

TEST(PageFiles, AreSentAsWhatTheyAre) {
    EXPECT_EQ(consolePage().type, "text/html; charset=utf-8");
    EXPECT_TRUE(consolePage().body.starts_with("<!doctype html>"));
    EXPECT_NE(panelPage().body.find("/page/panel.js"), std::string::npos);
    EXPECT_NE(panelPage().body, consolePage().body);
    ASSERT_TRUE(consoleFile("main.js"));
    EXPECT_EQ(consoleFile("main.js")->type, "text/javascript; charset=utf-8");
    EXPECT_EQ(consoleFile("style.css")->type, "text/css; charset=utf-8");
    for (const char* none : {"index.html", "panel.html", "", "../Door.h", "main.js/", "Main.js"})
        EXPECT_FALSE(consoleFile(none)) << none;
    EXPECT_NE(tokenPage().body.find("/page/return.js"), std::string::npos);
}

TEST(PageFiles, ReadNothingAsHtmlOrAsAProgram) {
    for (const PageFile& file : pageFiles())
        for (const char* word :
             {"innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function", "setHTML",
              "createContextualFragment", "DOMParser", "srcdoc", "javascript:"})
            EXPECT_EQ(file.text.find(word), std::string_view::npos) << file.name << " has " << word;
}

TEST(PageFiles, HaveScriptsAndStylesOfTheirOwnAlone) {
    const std::regex address("(src|href)=\"([^\"]*)\"|from '([^']*)'|url\\(([^)]*)\\)");
    for (const PageFile& file : pageFiles()) {
        const std::string text(file.text);
        for (std::sregex_iterator at(text.begin(), text.end(), address), end; at != end; ++at) {
            const std::string said = (*at)[2].str() + (*at)[3].str() + (*at)[4].str();
            if (said.starts_with("#") || said.starts_with("data:image/svg+xml,") || said == "/api.html") continue;
            const std::size_t name = said.rfind('/') + 1;
            EXPECT_TRUE(said.starts_with("/page/") || said.starts_with("./")) << file.name << ": " << said;
            EXPECT_TRUE(consoleFile(said.substr(name))) << file.name << ": " << said;
        }
        EXPECT_EQ(text.find("<style"), std::string::npos) << file.name;
        EXPECT_EQ(text.find(" style="), std::string::npos) << file.name;
    }
}

TEST(PageFiles, HaveLinesThatOneReads) {
    for (const PageFile& file : pageFiles()) {
        std::size_t letters = 0, line = 1;
        for (const char c : file.text) {
            if (c == '\n')
                letters = 0, ++line;
            else if ((static_cast<unsigned char>(c) & 0xC0) != 0x80)
                ++letters;
            ASSERT_LE(letters, 120u) << file.name << ':' << line;
        }
    }
}

}  // namespace
}  // namespace tessera
