// The few parts of the editor that the package uses. What is drawn is kept as lines.

using System;
using System.Collections.Generic;
using UnityEngine;

namespace UnityEngine
{
    public sealed class GUIStyle { }

    public struct Rect
    {
        public Rect(float x, float y, float width, float height) { }
    }

    public static class GUILayout
    {
        public static readonly HashSet<string> Pressed = new HashSet<string>();
        public static float Slid = -1f;
        public static bool Button(string text) { return Pressed.Contains(text); }
        public static void Label(string text) { UnityEditor.EditorGUILayout.Lines.Add(text); }
        public static float HorizontalSlider(float value, float least, float most) { return Slid < 0f ? value : Slid; }
        public static void BeginArea(Rect area) { }
        public static void EndArea() { }
    }
}

namespace UnityEditor
{
    public enum MessageType { None, Info, Warning, Error }

    public sealed class CustomEditor : Attribute { public CustomEditor(Type type) { } }

    public static class EditorStyles { public static GUIStyle wordWrappedLabel => null; }

    public static class EditorGUILayout
    {
        public static readonly List<string> Lines = new List<string>();
        public static void LabelField(string text) { Lines.Add(text); }
        public static void LabelField(string name, string value) { Lines.Add(name + ": " + value); }
        public static void LabelField(string name, string value, GUIStyle style) { Lines.Add(name + ": " + value); }
        public static void HelpBox(string text, MessageType type) { Lines.Add(type + ": " + text); }
    }

    public class Editor : ScriptableObject
    {
        public UnityEngine.Object target { get; set; }
        public virtual void OnInspectorGUI() { }
        public bool DrawDefaultInspector() { return false; }
    }
}

namespace UnityEditor.AssetImporters
{
    public sealed class ScriptedImporterAttribute : Attribute
    {
        public readonly string Extension;
        public ScriptedImporterAttribute(int version, string extension) { Extension = extension; }
    }

    public abstract class ScriptedImporter : UnityEngine.Object
    {
        public abstract void OnImportAsset(AssetImportContext ctx);
    }

    public class AssetImportContext
    {
        public readonly List<string> Errors = new List<string>();
        public string assetPath { get; set; }
        public UnityEngine.Object mainObject { get; private set; }
        private readonly Dictionary<string, UnityEngine.Object> objects = new Dictionary<string, UnityEngine.Object>();
        public void AddObjectToAsset(string identifier, UnityEngine.Object o) { objects.Add(identifier, o); }
        public void SetMainObject(UnityEngine.Object o)
        {
            if (!objects.ContainsValue(o)) throw new InvalidOperationException("an object that was not added");
            mainObject = o;
        }
        public void LogImportError(string message) { Errors.Add(message); }
    }
}
