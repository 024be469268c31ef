namespace Unic
{
    /// <summary>Rule for joints of the model that the rig has no bone for.</summary>
    public enum MissingJoints
    {
        /// <summary>The garment is not shown, and the message names the joints.</summary>
        Refuse,
        /// <summary>They move with the nearest parent that has a bone. The root needs one.</summary>
        FollowParent,
    }
}
