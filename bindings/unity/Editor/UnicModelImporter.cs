using System.IO;
using UnityEditor.AssetImporters;

namespace Unic.Editor
{
    /// <summary>Imports .unic files as UnicModel assets.</summary>
    [ScriptedImporter(1, "unic")]
    public sealed class UnicModelImporter : ScriptedImporter
    {
        /// <inheritdoc/>
        public override void OnImportAsset(AssetImportContext ctx)
        {
            byte[] bytes = File.ReadAllBytes(ctx.assetPath);
            UnicModel model = UnicModel.FromBytes(Path.GetFileNameWithoutExtension(ctx.assetPath), bytes);
            // The asset is made in either case: a project opens without the native library, too.
            ctx.AddObjectToAsset("model", model);
            ctx.SetMainObject(model);
            try
            {
                model.Acquire();
                model.Release();
            }
            catch (UnicException error)
            {
                ctx.LogImportError(ctx.assetPath + ": " + error.Message);
            }
        }
    }
}
