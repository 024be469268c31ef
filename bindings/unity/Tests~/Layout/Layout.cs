// Contract: the structs, enumerations, constants and functions of Runtime/Native are those of
// unic.h, none missing and none more: names, order, sizes, offsets, values, and kinds of parameters.
//
//     Layout.exe probe unic.h > probe.c     a C program that prints the layout of the header
//     Layout.exe check unic.h layout.txt    compares this assembly with what it has printed

using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Text;
using System.Text.RegularExpressions;
using Unic.Native;

internal static class Layout
{
    // Handles and callbacks, which have no counterpart of their own in C#.
    private static readonly HashSet<string> Opaque = new HashSet<string> { "UnicModel", "UnicInstance" };

    private static readonly List<string> faults = new List<string>();

    private static int Main(string[] arguments)
    {
        string header = WithoutComments(File.ReadAllText(arguments[1]));
        if (arguments[0] == "probe")
        {
            Console.Write(Probe(header));
            return 0;
        }
        Dictionary<string, string> expected = File.ReadAllLines(arguments[2]).Select(line => line.Split(' '))
            .ToDictionary(words => words[0], words => words[1]);
        Dictionary<string, string> found = OfAssembly(header);
        foreach (string key in expected.Keys.Union(found.Keys).OrderBy(key => key, StringComparer.Ordinal))
        {
            string of = Value(expected, key), ours = Value(found, key);
            if (of != ours) faults.Add(key + ": expected " + of + ", found " + ours);
        }
        int functions = CheckFunctions(header);
        foreach (string fault in faults) Console.WriteLine(fault);
        Console.WriteLine("layout: " + expected.Count + " facts and " + functions + " functions of unic.h, "
                          + faults.Count + " differ");
        if (expected.Count < 80 || functions < 25) throw new Exception("the header was not read");
        return faults.Count == 0 ? 0 : 1;
    }

    private static string Value(Dictionary<string, string> facts, string key)
    {
        string value;
        return facts.TryGetValue(key, out value) ? value : "none";
    }

    private static string WithoutComments(string text)
    {
        return Regex.Replace(text, @"/\*.*?\*/|//[^\n]*", " ", RegexOptions.Singleline);
    }

    private static IEnumerable<KeyValuePair<string, string>> Structs(string header)
    {
        foreach (Match match in Regex.Matches(header, @"typedef struct (\w+) \{(.*?)\} \1;", RegexOptions.Singleline))
            yield return new KeyValuePair<string, string>(match.Groups[1].Value, match.Groups[2].Value);
    }

    private static IEnumerable<string> Fields(string body)
    {
        foreach (Match match in Regex.Matches(body, @"(\w+)(?:\[\d+\])?;")) yield return match.Groups[1].Value;
    }

    private static IEnumerable<KeyValuePair<string, string[]>> Enums(string header)
    {
        foreach (Match match in Regex.Matches(header, @"enum (\w+)\s+#if.*?#endif\s*\{(.*?)\};", RegexOptions.Singleline))
        {
            string[] names = Regex.Matches(match.Groups[2].Value, @"(UNIC_\w+) =").Cast<Match>()
                .Select(name => name.Groups[1].Value).ToArray();
            yield return new KeyValuePair<string, string[]>(match.Groups[1].Value, names);
        }
    }

    private static string Probe(string header)
    {
        StringBuilder c = new StringBuilder("#include \"unic.h\"\n#include <stdio.h>\nint main(void) {\n");
        foreach (KeyValuePair<string, string> type in Structs(header))
        {
            c.AppendFormat("printf(\"{0} %zu\\n\", sizeof({0}));\n", type.Key);
            foreach (string field in Fields(type.Value))
                c.AppendFormat("printf(\"{0}.{2} %zu:%zu\\n\", offsetof({0}, {1}), sizeof((({0} *)0)->{1}));\n",
                    type.Key, field, Camel(field));
        }
        foreach (KeyValuePair<string, string[]> type in Enums(header))
            foreach (string name in type.Value)
                c.AppendFormat("printf(\"{0}.{2} %u\\n\", (unsigned){1});\n", type.Key, name,
                    Pascal(name.Substring(Snake(type.Key).Length + 1)));
        foreach (Match constant in Regex.Matches(header, @"#define (UNIC_\w+) \d+"))
            c.AppendFormat("printf(\"{0} %u\\n\", (unsigned){0});\n", constant.Groups[1].Value);
        c.Append("return 0;\n}\n");
        return c.ToString();
    }

    private static Dictionary<string, string> OfAssembly(string header)
    {
        Dictionary<string, string> facts = new Dictionary<string, string>();
        HashSet<string> structs = new HashSet<string>(Structs(header).Select(type => type.Key));
        Assembly assembly = typeof(NativeMethods).Assembly;
        foreach (Type type in assembly.GetTypes().Where(t => t.Namespace == "Unic.Native" && t.IsValueType && !t.IsNested))
        {
            if (type.IsEnum) continue;
            if (!structs.Contains(type.Name)) faults.Add(type.Name + ": expected a struct of unic.h");
            facts[type.Name] = Marshal.SizeOf(type).ToString();
            foreach (FieldInfo field in type.GetFields())
                facts[type.Name + "." + field.Name] = Marshal.OffsetOf(type, field.Name) + ":" + Size(field);
        }
        foreach (Type type in Enums(header).Select(e => Named(assembly, e.Key)).Where(t => t != null))
            foreach (object value in Enum.GetValues(type))
                facts[type.Name + "." + value] = Convert.ToUInt32(value).ToString();
        foreach (FieldInfo constant in typeof(NativeMethods).GetFields(BindingFlags.Static | BindingFlags.NonPublic))
            if (constant.Name.StartsWith("UNIC_")) facts[constant.Name] = constant.GetRawConstantValue().ToString();
        return facts;
    }

    private static Type Named(Assembly assembly, string name)
    {
        return assembly.GetType("Unic.Native." + name) ?? assembly.GetType("Unic." + name);
    }

    private static int Size(FieldInfo field)
    {
        Type type = field.FieldType;
        if (type.IsPointer || type == typeof(IntPtr) || type == typeof(UIntPtr)) return IntPtr.Size;
        if (type.IsEnum) return 4;
        return Marshal.SizeOf(type);
    }

    private static int CheckFunctions(string header)
    {
        Dictionary<string, MethodInfo> ours = typeof(NativeMethods)
            .GetMethods(BindingFlags.Static | BindingFlags.NonPublic | BindingFlags.DeclaredOnly)
            .Where(method => method.Name.StartsWith("unic_")).ToDictionary(method => method.Name);
        HashSet<string> seen = new HashSet<string>();
        string pattern = @"([\w ]+[ *])(unic_\w+)\(([^)]*)\);";
        foreach (Match match in Regex.Matches(header, pattern))
        {
            string name = match.Groups[2].Value;
            seen.Add(name);
            MethodInfo method;
            if (!ours.TryGetValue(name, out method))
            {
                faults.Add(name + ": expected a declaration, found none");
                continue;
            }
            string list = match.Groups[3].Value.Trim();
            string[] kinds = list == "void" ? new string[0] : list.Split(',').Select(CKind).ToArray();
            string expected = CKind(match.Groups[1].Value + "result") + "(" + string.Join(", ", kinds) + ")";
            string found = Kind(method.ReturnType) + "("
                + string.Join(", ", method.GetParameters().Select(p => Kind(p)).ToArray()) + ")";
            if (expected != found) faults.Add(name + ": expected " + expected + ", found " + found);
        }
        foreach (string name in ours.Keys.Where(name => !seen.Contains(name)))
            faults.Add(name + ": expected a function of unic.h");
        return seen.Count;
    }

    private static string CKind(string declaration)
    {
        if (declaration.Contains("*"))
        {
            string handle = Opaque.FirstOrDefault(o => Regex.IsMatch(declaration, @"\b" + o + @" \*\w"));
            if (handle != null) return handle;
            string to = Regex.Replace(declaration, @"\b(const|struct)\b|\s", "");
            return Regex.Match(to, @"^(\w+?)\*+").Groups[1].Value == "char" ? "text" : "pointer";
        }
        foreach (string kind in new[] { "uint64_t", "uint32_t", "size_t", "float", "UnicStatus" })
            // An enumeration crosses as its number.
            if (Regex.IsMatch(declaration, @"\b" + kind + @"\b")) return kind == "UnicStatus" ? "uint32_t" : kind;
        throw new Exception("unknown type: " + declaration);
    }

    private static string Kind(ParameterInfo parameter)
    {
        // Releases take the number of a handle, which its SafeHandle passes.
        if (parameter.ParameterType == typeof(IntPtr) && parameter.Member.Name.EndsWith("_release"))
            return parameter.Member.Name.Contains("model") ? "UnicModel" : "UnicInstance";
        return Kind(parameter.ParameterType);
    }

    private static string Kind(Type type)
    {
        if (type == typeof(byte*) || type == typeof(byte**)) return "text";
        if (type.IsPointer) return "pointer";
        if (type == typeof(ModelHandle)) return "UnicModel";
        if (type == typeof(InstanceHandle)) return "UnicInstance";
        if (type == typeof(UIntPtr)) return "size_t";
        if (type == typeof(float)) return "float";
        if (type == typeof(ulong)) return "uint64_t";
        if (type == typeof(uint) || type.IsEnum) return "uint32_t";
        return type.Name;
    }

    private static string Pascal(string upperSnake)
    {
        return string.Concat(upperSnake.Split('_').Select(w => w.Substring(0, 1) + w.Substring(1).ToLowerInvariant()).ToArray());
    }

    private static string Camel(string snake)
    {
        string pascal = Pascal(snake.ToUpperInvariant());
        return char.ToLowerInvariant(pascal[0]) + pascal.Substring(1);
    }

    private static string Snake(string pascal)
    {
        return Regex.Replace(pascal, @"(?<=[a-z0-9])(?=[A-Z])", "_").ToUpperInvariant();
    }
}
