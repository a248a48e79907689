(** Bounds in both parts of a box, of which a bound in the box follows. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges Signs Cover.
Import ListNotations.
Open Scope R_scope.

Lemma same_function_eq f g : same_function f g = true -> f = g.
Proof.
  destruct f, g; simpl; try discriminate; intros H.
  - now apply Nat.eqb_eq in H; subst.
  - apply andb_prop in H. destruct H as [H G]. apply Nat.eqb_eq in H, G. now subst.
Qed.
Lemma has_slope_in_holds ps accepted f moves scale b u : Forall (holds ps) accepted ->
  has_slope_in accepted f moves scale b u = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  induction accepted as [|c accepted IH]; cbn [has_slope_in]; [discriminate|]. intros H G.
  inversion H as [|? ? Hc Hr]; subst. destruct c; auto. apply orb_prop in G. destruct G as [G|G]; auto.
  do 4 both G. apply same_function_eq in G. apply same_moves_eq in H3. apply same_numbers_eq in H2.
  apply same_box_eq in H1. apply at_most_real in H0. subst.
  intros rest x y A L X Y. eapply Rle_trans; [exact (Hc rest x y A L X Y)|].
  apply Rmult_le_compat_r; auto. apply sqrt_pos.
Qed.
Lemma lengths_of_values ps f moves scale : well_formed ps f moves scale = true ->
  exists n, forall rest x, length (value_of ps f rest x) = n.
Proof.
  unfold well_formed. intros H. do 4 both H. destruct f as [p|phi rho]; simpl in H.
  - eexists. intros rest x. simpl. apply length_value. now both H.
  - apply andb_prop in H. destruct H as [_ H]. eexists. intros rest x. simpl. apply length_value. now both H.
Qed.

Theorem halves_sound ps accepted f moves scale b u k m : Forall (holds ps) accepted ->
  check_halves ps accepted f moves scale b u k m = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  intros HA H. unfold check_halves in H. both H. both H. destruct (lengths_of_values _ _ _ _ H) as [n N].
  pose proof (has_slope_in_holds _ _ _ _ _ _ _ HA H0) as Upper.
  pose proof (has_slope_in_holds _ _ _ _ _ _ _ HA H1) as Lower.
  intros rest x y A L X Y. set (g := value_of ps f rest).
  assert (forall z w, agree moves z w -> length z = inputs_of (part_at ps (moved f)) -> within b z -> within b w ->
    nth k z 0 <= real m -> nth k w 0 <= real m -> norm (minus (g z) (g w)) <= real u * distance scale z w) as Below.
  { intros z w Azw Lz Z W Hz Hw. apply Lower; auto; now apply (within_cut b k m false). }
  assert (forall z w, agree moves z w -> length z = inputs_of (part_at ps (moved f)) -> within b z -> within b w ->
    real m <= nth k z 0 -> real m <= nth k w 0 -> norm (minus (g z) (g w)) <= real u * distance scale z w) as Above.
  { intros z w Azw Lz Z W Hz Hw. apply Upper; auto; now apply (within_cut b k m true). }
  assert (length x = length y) as E by (destruct (agree_lengths _ _ _ A); congruence).
  assert (forall s, 0 <= s <= 1 -> nth k (on_the_way s x y) 0 = real m ->
    norm (minus (g x) (g (on_the_way s x y))) <= real u * distance scale x (on_the_way s x y) ->
    norm (minus (g (on_the_way s x y)) (g y)) <= real u * distance scale (on_the_way s x y) y ->
    norm (minus (g x) (g y)) <= real u * distance scale x y) as Through.
  { intros s Hs _ F G. rewrite (minus_through _ (g (on_the_way s x y))) by (unfold g; now rewrite !N).
    eapply Rle_trans; [apply norm_plus|]. destruct (distance_way scale x y s Hs E) as [D1 D2].
    rewrite D1 in F. rewrite D2 in G. lra. }
  destruct (Rle_dec (nth k x 0) (real m)) as [Lx|Lx], (Rle_dec (nth k y 0) (real m)) as [Ly|Ly];
    [now apply Below| | |apply Above; auto; lra].
  all: set (p := nth k x 0) in *; set (q := nth k y 0) in *; set (s := (p - real m) / (p - q));
    assert (s * (p - q) = p - real m) as Es by (unfold s; field; lra); assert (0 <= s <= 1) as Hs by (split; nra);
    assert (nth k (on_the_way s x y) 0 = real m) as M by (rewrite nth_on_the_way; fold p q; lra);
    destruct (way_agrees moves x y s A) as [A1 A2]; pose proof (way_within b x y s Hs X Y) as Z;
    assert (length (on_the_way s x y) = inputs_of (part_at ps (moved f))) as Lz
      by (rewrite length_way by auto; congruence);
    apply (Through s Hs M).
  - apply Below; auto. lra.
  - apply Above; auto; fold q; lra.
  - apply Above; auto; fold p; lra.
  - apply Below; auto. lra.
Qed.
