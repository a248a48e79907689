(** A bound between two points at which no neuron changes its sign holds between any two: a straight line is cut where
    one does. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Centred Parts Claims Slopes Witness Laws Ranges Relaxation Increments.
Import ListNotations.
Open Scope R_scope.

(** The point at s on the way from x to y. *)
Definition on_the_way (s : R) (x y : list R) : list R := plusR (scaleR (1 - s) x) (scaleR s y).

Lemma affine_way w c s x y : affine (realm w) (reals c) (on_the_way s x y) =
  on_the_way s (affine (realm w) (reals c) x) (affine (realm w) (reals c) y).
Proof.
  unfold affine, on_the_way. generalize (reals c). intros b. revert b.
  induction w as [|row w IH]; intros [|a b]; simpl; auto.
  - f_equal; [ring|]. clear. induction b as [|d b IH]; simpl; auto. f_equal; [ring|auto].
  - rewrite dot_comm, dot_plus_l, !dot_scale_l, !(dot_comm _ (reals row)). f_equal. specialize (IH []).
    rewrite !plus_nil_r in IH. exact IH.
  - rewrite dot_comm, dot_plus_l, !dot_scale_l, !(dot_comm _ (reals row)). f_equal; [ring|]. apply IH.
Qed.
Lemma relu_way s x y : 0 <= s <= 1 -> (forall i, same_sign (nth i x 0) (nth i y 0)) -> length x = length y ->
  map relu (on_the_way s x y) = on_the_way s (map relu x) (map relu y).
Proof.
  intros Hs. unfold on_the_way. revert y. induction x as [|a x IH]; intros [|b y] S; simpl; try discriminate; auto.
  intros L. f_equal; [|apply IH; [intros i; apply (S (Datatypes.S i))|lia]].
  destruct (S O) as [[H G]|[H G]]; simpl in H, G.
  - rewrite !relu_right; auto. nra.
  - rewrite !relu_left; auto; [ring|nra].
Qed.
Section Signs.
Context (ls : list layerD) (fits : Forall (fun l : layerD => length (snd l) = length (fst l)) ls).
Lemma way_values s k x y : 0 <= s <= 1 ->
  (forall k' i, (k' < k)%nat -> same_sign (value_at ls k' i x) (value_at ls k' i y)) ->
  layer_values ls k (on_the_way s x y) = on_the_way s (layer_values ls k x) (layer_values ls k y).
Proof.
  intros Hs. unfold value_at. revert x y k. induction fits as [|[w c] l Hc F IH]; intros x y [|k] S; simpl; auto.
  - apply affine_way.
  - rewrite affine_way, relu_way; auto.
    + apply IH; auto. intros k' i L. apply (S (Datatypes.S k') i). lia.
    + intros i. apply (S O i). lia.
    + simpl in Hc. rewrite !length_affine; now rewrite ?map_length.
Qed.
Lemma length_values k x : length (layer_values ls k x) = length (fst (nth k ls ([], []))).
Proof.
  revert x k. induction fits as [|[w c] l Hc F IH]; intros x [|k]; simpl; auto.
  rewrite length_affine by (simpl in Hc; now rewrite !map_length). apply map_length.
Qed.
Context (B : list R -> list R -> Prop) (D : list R -> Prop) (moves : list bool).
Context (convex : forall x y s, 0 <= s <= 1 -> D x -> D y -> D (on_the_way s x y)).
Context (agrees : forall x y s, agree moves x y ->
  agree moves x (on_the_way s x y) /\ agree moves (on_the_way s x y) y).
Context (joins : forall x y s, 0 <= s <= 1 -> agree moves x y ->
  B x (on_the_way s x y) -> B (on_the_way s x y) y -> B x y).
(** The neurons of the first k layers, and the first j of the next. *)
Definition same_up_to (k j : nat) (x y : list R) : Prop :=
  (forall k' i, (k' < k)%nat -> same_sign (value_at ls k' i x) (value_at ls k' i y)) /\
  (forall i, (i < j)%nat -> same_sign (value_at ls k i x) (value_at ls k i y)).
Definition enough (k j : nat) : Prop := forall x y, D x -> D y -> agree moves x y -> same_up_to k j x y -> B x y.
Lemma value_way s k i x y : 0 <= s <= 1 ->
  (forall k' i, (k' < k)%nat -> same_sign (value_at ls k' i x) (value_at ls k' i y)) ->
  value_at ls k i (on_the_way s x y) = (1 - s) * value_at ls k i x + s * value_at ls k i y.
Proof.
  intros Hs S. unfold value_at. rewrite way_values by auto. unfold on_the_way. now rewrite nth_plus, !nth_scaled.
Qed.
Lemma between_signs a b s : 0 <= s <= 1 -> same_sign a b ->
  same_sign a ((1 - s) * a + s * b) /\ same_sign ((1 - s) * a + s * b) b.
Proof. intros Hs [[H G]|[H G]]; unfold same_sign; split; [left|left|right|right]; split; nra. Qed.
Lemma one_neuron k j : enough k (S j) -> enough k j.
Proof.
  intros E x y Dx Dy A [S1 S2].
  assert (same_sign (value_at ls k j x) (value_at ls k j y) -> B x y) as Same.
  { intros H. apply E; auto. split; auto. intros i L. destruct (Nat.eq_dec i j) as [->|]; auto. apply S2. lia. }
  set (a := value_at ls k j x) in *. set (b := value_at ls k j y) in *.
  destruct (Rle_dec 0 a) as [Ha|Ha], (Rle_dec 0 b) as [Hb|Hb]; try (apply Same; unfold same_sign; lra).
  all: set (s := a / (a - b)); assert (s * (a - b) = a) as Es by (unfold s; field; lra);
    assert (0 <= s <= 1) as Hs by (split; nra); destruct (agrees x y s A) as [A1 A2];
    assert (value_at ls k j (on_the_way s x y) = 0) as Z by (rewrite value_way by auto; fold a b; lra);
    apply (joins x y s Hs A); apply E; auto; split;
    [intros k' i L|intros i L|intros k' i L|intros i L].
  all: try (rewrite value_way by (auto; intros; apply S1; lia); apply between_signs; auto; fail).
  all: try (destruct (Nat.eq_dec i j) as [->|]; [rewrite Z; unfold same_sign; fold a b; lra|];
    rewrite value_way by auto; apply between_signs; auto; apply S2; lia).
Qed.
Lemma all_neurons : (forall x y, D x -> D y -> agree moves x y -> same_signs ls x y -> B x y) ->
  forall x y, D x -> D y -> agree moves x y -> B x y.
Proof.
  intros H. assert (forall k, enough k 0) as E.
  2:{ intros x y Dx Dy A. apply (E O); auto. split; intros; lia. }
  assert (forall k j, enough k j -> enough k 0) as First by (intros k j; induction j; auto using one_neuron).
  assert (forall k, enough (S k) 0 -> enough k 0) as Layer.
  { intros k Ek. apply (First k (length (fst (nth k ls ([], []))))). intros x y Dx Dy A [S1 S2].
    apply Ek; auto. split; [|lia].
    intros k' i L. destruct (Nat.eq_dec k' k) as [->|]; [|apply S1; lia].
    destruct (lt_dec i (length (fst (nth k ls ([], []))))) as [Li|Li]; [now apply S2|].
    unfold value_at. rewrite !nth_overflow by (rewrite length_values; lia). unfold same_sign. lra. }
  assert (forall n k, enough (n + k) 0 -> enough k 0) as Down.
  { induction n as [|n IHn]; intros k G; [exact G|]. apply IHn, Layer, G. }
  intros k. apply (Down (length ls) k). intros x y Dx Dy A [S1 _]. apply H; auto. intros k' i.
  destruct (lt_dec k' (length ls)) as [L|L]; [apply S1; lia|].
  unfold value_at. rewrite !nth_overflow; [unfold same_sign; lra| |];
    rewrite length_values, nth_overflow by lia; simpl; lia.
Qed.
End Signs.
