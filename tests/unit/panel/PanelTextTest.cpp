// Panels as files.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "server/panel/Panel.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

std::string faultIn(const std::string& text) {
    const Expected<Panel> panel = parsePanel(text, "x.panel");
    return panel ? "" : panel.error().message;
}

TEST(PanelText, ReadsEachKindOfControl) {
    const Expected<Panel> panel = parsePanel(R"(# of a hall
title: "Hall"
controls { label: "a" node: "/n" field: "f" slider { least: -1 greatest: 2 step: 0.5 } }
controls { label: "b" node: "/n" field: "f" toggle {} }
controls { label: "c" node: "/n" field: "f" choice { options { label: "o" value: "1 2" } options { value: "3 4" } } }
controls { label: "d" node: "/n" field: "f" colour {} }
controls { label: "e" node: "/n" field: "f" text { bytes: 9 } }
controls { label: "g" press { sets { node: "/m" field: "h" value: "true" } bookmark: 9 } }
)",
                                             "x.panel");
    ASSERT_TRUE(panel) << panel.error().message;
    EXPECT_EQ(panel->title, "Hall");
    ASSERT_EQ(panel->controls.size(), 6u);
    EXPECT_EQ(std::get<PanelSlider>(panel->controls[0].as).step, 0.5);
    EXPECT_EQ(panel->controls[1].of, (PanelField{"/n", "f"}));
    EXPECT_EQ(std::get<PanelChoice>(panel->controls[2].as).options.at(1).value, "3 4");
    EXPECT_EQ(std::get<PanelText>(panel->controls[4].as).bytes, 9u);
    EXPECT_EQ(std::get<PanelPress>(panel->controls[5].as).sets.at(0).of.node, "/m");
}

TEST(PanelText, SaysWhatIsWrongAndWhere) {
    const std::string of = R"(node: "/n" field: "f" )";
    const std::vector<std::pair<std::string, std::string>> placed{
        {"", "x.panel:1:1: "},
        {"\ncontrols {\n  lable: \"a\" }", "x.panel:3:3: "},
        {"title: \"a\"\ncontrols { " + of + "}", "x.panel:2:1: "},
    };
    for (const auto& [text, place] : placed) {
        EXPECT_TRUE(faultIn(text).starts_with(place)) << faultIn(text);
        EXPECT_WORDS(faultIn(text));
    }
    for (const std::string& text : {"controls { " + of + "toggle {} slider {} }", std::string("not a panel at all")})
        EXPECT_TRUE(faultIn(text).starts_with("x.panel:1:")) << faultIn(text);  // in protobuf's words
    const std::vector<std::string> wrong{
        "controls { " + of + "slider { least: 1 greatest: 1 } }",
        "controls { " + of + "slider { least: nan greatest: 1 } }",
        "controls { " + of + "slider { least: 0 greatest: inf } }",
        "controls { " + of + "slider { greatest: 1 step: 2 } }",
        "controls { " + of + "slider { greatest: 1 step: -1 } }",
        "controls { toggle {} }",
        "controls { " + of + "choice {} }",
        "controls { press {} }",
        "controls { press { bookmark: 10 } }",
        "controls { press { bookmark: 1 home: true } }",
        "controls { " + of + "press { home: true } }",
        "controls { press { sets { node: \"/n\" } } }",
        std::string(Panel::kMostBytes + 1, ' '),
        "controls { " + of + "choice { options { label: \"" + std::string(300, 'x') + "\" } } }",
        "controls { " + of + "choice { options { value: \"" + std::string(5000, '1') + "\" } } }",
        "controls { press { sets { " + of + "value: \"" + std::string(5000, '1') + "\" } } }",
        "controls { node: \"/" + std::string(5000, 'n') + "\" field: \"f\" toggle {} }",
        "controls { label: \"" + std::string(300, 'x') + "\" " + of + "toggle {} }",
    };
    for (const std::string& text : wrong) EXPECT_WORDS(faultIn(text));
    std::string many;
    for (std::size_t i = 0; i <= Panel::kMostControls; ++i) many += "controls { " + of + "toggle {} }\n";
    EXPECT_WORDS(faultIn(many));
}

TEST(PanelText, WhatIsNoFileIsSaid) {
    EXPECT_EQ(readPanelFile("/nowhere/x.panel").error().code, ErrorCode::kNotFound);
    EXPECT_EQ(readPanelFile("/").error().code, ErrorCode::kBadInput);
    EXPECT_EQ(readPanelFile("/dev/zero").error().code, ErrorCode::kBadInput);
}

}  // namespace
}  // namespace tessera
