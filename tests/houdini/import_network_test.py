"""The network that apps/houdini/polestar_import.py builds, on stand-ins for Houdini's nodes.

    python3 import_network_test.py FOLDER_OF_THE_SCRIPT
"""

import re
import sys
import unittest

FOLDER = sys.argv.pop(1)
sys.path.insert(0, FOLDER)

import polestar_import  # noqa: E402

# Types of nodes and their parameters that the script may use, as SideFX documents them.
NODE_TYPES = {
    "geo": set(), "null": set(), "merge": set(), "file": {"file", "missingframe"}, "object_merge": {"objpath1"},
    "attribwrangle": {"class", "snippet"}, "volumewrangle": {"snippet"}}
VEX_FUNCTIONS = {"abs", "atan2", "distance", "dot", "length", "lerp", "nearpoint", "onoise", "point", "removeprim",
                 "sin", "smooth", "volumesamplev"}


class Parm:
    def __init__(self):
        self.value = None

    def set(self, value):
        self.value = value


class Node:
    def __init__(self, kind="root", name="root"):
        self.kind, self.name = kind, name
        self.inputs, self.nodes, self.flags = {}, {}, set()
        self.parms = {parm: Parm() for parm in NODE_TYPES.get(kind, ())}

    def createNode(self, kind, name):  # noqa: N802, Houdini's name
        assert kind in NODE_TYPES, kind
        assert name not in self.nodes, name
        self.nodes[name] = Node(kind, name)
        return self.nodes[name]

    def parm(self, name):
        return self.parms.get(name)  # None for an unknown one, as in Houdini

    def setInput(self, index, node):  # noqa: N802
        self.inputs[index] = node

    def setDisplayFlag(self, on):  # noqa: N802
        self.flags |= {"display"} if on else set()

    def setRenderFlag(self, on):  # noqa: N802
        self.flags |= {"render"} if on else set()

    def layoutChildren(self):  # noqa: N802
        pass

    def value(self, name):
        return self.parms[name].value


def built(*arguments, **named):
    root = Node()
    out = polestar_import.import_solid(root, *arguments, **named)
    return root.nodes["polestar_solid"].nodes, out


class ImportNetwork(unittest.TestCase):
    def test_own_colors(self):
        nodes, out = built("$HIP/kiwi_####.vdb")
        self.assertEqual(list(nodes), ["solid", "names", "OUT"])
        self.assertEqual(nodes["solid"].value("file"), "$HIP/kiwi_$F4.vdb")
        self.assertEqual(nodes["solid"].value("missingframe"), "error")
        self.assertIs(nodes["names"].inputs[0], nodes["solid"])
        self.assertEqual(nodes["names"].value("class"), "primitive")
        self.assertIs(out, nodes["OUT"])
        self.assertIs(out.inputs[0], nodes["names"])
        self.assertEqual(out.flags, {"display", "render"})

    def test_computed_colors(self):
        nodes, out = built("a.vdb", look="marble")
        self.assertEqual(nodes["solid"].value("file"), "a.vdb")
        look, merge = out.inputs[0], nodes["with_colors"]
        self.assertEqual(look.kind, "volumewrangle")
        self.assertEqual(look.value("snippet"), polestar_import.snippet("marble"))
        self.assertEqual(look.inputs, {0: merge})
        # The wrangle writes Cd, which has to be there once: from the branch that makes it of rest.
        self.assertEqual(merge.inputs, {0: nodes["without_colors"], 1: nodes["colors"]})
        for name in ("without_colors", "colors"):
            self.assertIs(nodes[name].inputs[0], nodes["solid"])
            self.assertEqual(nodes[name].value("class"), "primitive")

    def test_points(self):
        nodes, out = built("a.vdb", look="seeds", points="/obj/ball/scatter1")
        self.assertIs(out.inputs[0].inputs[1], nodes["points"])
        self.assertEqual(nodes["points"].value("objpath1"), "/obj/ball/scatter1")

    def test_unknown_look(self):
        root = Node()
        with self.assertRaisesRegex(ValueError, "marble, seeds, shells, stripes"):
            polestar_import.import_solid(root, "a.vdb", look="granite")
        self.assertEqual(root.nodes, {})

    def test_snippets(self):
        code = [polestar_import.snippet(look) for look in polestar_import.looks()]
        self.assertEqual(len(code), 4)
        for text in code:
            self.assertIn('volumesamplev(0, "rest", v@P)', text)
            self.assertRegex(text, r"v@Cd = ")
        for text in code + [polestar_import.WITHOUT_COLORS, polestar_import.COLORS_OF_REST]:
            text = re.sub(r"//.*", "", text)
            self.assertEqual(text.count("{"), text.count("}"))
            self.assertEqual(text.count("("), text.count(")"))
            called = set(re.findall(r"(\w+)\s*\(", text)) - {"if"}
            self.assertLessEqual(called, VEX_FUNCTIONS)


unittest.main()
